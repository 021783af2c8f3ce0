"""Put uPlot into the dashboard: a pinned version from npm, checked against its hash.

Nothing is downloaded at the user's: the files are part of the repository and of the wheel.
"""

from __future__ import annotations

import base64
import hashlib
import io
import tarfile
import urllib.request
from pathlib import Path

VERSION = "1.6.32"
URL = f"https://registry.npmjs.org/uplot/-/uplot-{VERSION}.tgz"
#: ``npm view uplot@VERSION dist.integrity``
SHA512 = "KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw=="

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "composer" / "dashboard" / "page" / "vendor" / "uplot"
FILES = ("dist/uPlot.esm.js", "dist/uPlot.min.css", "LICENSE")


def unpacked(archive: bytes) -> dict[str, bytes]:
    """Return the bundled files of the package by name. Exits if it is not the pinned one."""
    digest = base64.b64encode(hashlib.sha512(archive).digest()).decode()
    if digest != SHA512:
        raise SystemExit(f"{URL} has the hash {digest}, expected {SHA512}")
    with tarfile.open(fileobj=io.BytesIO(archive)) as package:
        return {Path(name).name: _content(package, name) for name in FILES}


def _content(package: tarfile.TarFile, name: str) -> bytes:
    found = package.extractfile(f"package/{name}")
    if found is None:
        raise SystemExit(f"uPlot {VERSION} has no {name}")
    return found.read()


def main() -> None:
    """Download and write all files."""
    with urllib.request.urlopen(URL, timeout=60) as response:
        files = unpacked(response.read())
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (FOLDER / name).write_bytes(content)


if __name__ == "__main__":
    main()
