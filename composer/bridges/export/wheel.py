"""A wheel of the composer as it is installed here, for images: no package index need have it.

See packaging.python.org/en/latest/specifications/binary-distribution-format.
"""

from __future__ import annotations

import base64
import hashlib
import io
import zipfile
from collections.abc import Iterator
from importlib.metadata import Distribution, distribution
from pathlib import Path

from composer.base.resources import data_folder

_PACKAGE = Path(__file__).resolve().parents[2]
#: Besides the package, in a checkout; in an installation, they are in the package.
_SHARED = ("docs/rules", "interfaces", "nodes", "schemas", "systems")
_ABOUT = "Wheel-Version: 1.0\nGenerator: compose export\nRoot-Is-Purelib: true\nTag: py3-none-any\n"


def wheel(distribution_name: str) -> tuple[str, bytes]:
    """Return the name and the content of the wheel, the same for the same files.

    Raises PackageNotFoundError if the composer is not installed, and OSError.
    """
    installed = distribution(distribution_name)
    name = f"{distribution_name.replace('-', '_')}-{installed.version}"
    info = f"{name}.dist-info"
    files = dict(_package())
    files |= {f"{info}/{path}": data for path, data in _metadata(installed)}
    record = [f"{path},{_digest(data)},{len(data)}\n" for path, data in files.items()]
    files[f"{info}/RECORD"] = "".join([*record, f"{info}/RECORD,,\n"]).encode()
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path), data, zipfile.ZIP_DEFLATED)
    return f"{name}-py3-none-any.whl", content.getvalue()


def _package() -> Iterator[tuple[str, bytes]]:
    yield from _below(_PACKAGE, "composer")
    if data_folder() != _PACKAGE / "share":
        for name in _SHARED:
            yield from _below(data_folder() / name, f"composer/share/{Path(name).name}")


def _below(folder: Path, prefix: str) -> Iterator[tuple[str, bytes]]:
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.parent.name != "__pycache__":
            yield f"{prefix}/{path.relative_to(folder).as_posix()}", path.read_bytes()


def _metadata(installed: Distribution) -> Iterator[tuple[str, bytes]]:
    about = installed.read_text("METADATA") or installed.read_text("PKG-INFO") or ""
    yield "METADATA", about.encode()
    yield "WHEEL", _ABOUT.encode()
    yield "entry_points.txt", (installed.read_text("entry_points.txt") or "").encode()
    for path in installed.files or ():
        _, found, license_name = path.as_posix().partition(".dist-info/licenses/")
        if found:
            yield f"licenses/{license_name}", Path(str(path.locate())).read_bytes()


def _digest(data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
    return f"sha256={digest}"
