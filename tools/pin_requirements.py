"""Pin the environments that make creates: write requirements/*.txt, with the hash of every file.

    python tools/pin_requirements.py

One file serves every Python and platform that the project supports. Pinned versions are kept if
they still fit; --upgrade takes the newest. Needs uv and the package index.
"""

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "requirements"
#: An editable install needs it besides the build backend.
EDITABLE = "editables>=0.5"
#: scikit-build-core asks for these only where the system has none.
BUILD_PROGRAMS = ("cmake", "ninja")


def _build_requirements(project: Path) -> list[str]:
    content = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))
    return list(content["build-system"]["requires"])


def environments() -> dict[str, tuple[list[str], list[str]]]:
    """Return, by the name of the file, the extras of the project and the other requirements."""
    build = [*_build_requirements(ROOT), EDITABLE]
    interfaces = [*_build_requirements(ROOT / "interfaces"), *BUILD_PROGRAMS]
    return {
        # pytest for the tests of projects that compose new writes.
        "run": (["ros", "dashboard", "bags"], [*build, "pytest>=9.0"]),
        "dev": (["ros", "dev", "docs"], build),
        "test": (["test"], build),
        "interfaces": ([], interfaces),
        "fuzz": ([], ["atheris<3.1"]),  # 3.1 has no wheel for Python 3.11
        "tools": ([], ["py-spy", "uv"]),
    }


def _pin(name: str, extras: list[str], requirements: list[str], options: list[str]) -> None:
    command = ["uv", "pip", "compile", "--quiet", "--universal", "--python-version", "3.11"]
    command += ["--generate-hashes", "--no-emit-index-url", "--no-emit-find-links"]
    command += ["--custom-compile-command", "make requirements", *options]
    command += ["--output-file", str(FOLDER.relative_to(ROOT) / f"{name}.txt"), "-"]
    if extras:
        command += ["pyproject.toml", *(f"--extra={extra}" for extra in extras)]
    subprocess.run(command, cwd=ROOT, check=True, text=True, input="\n".join(requirements))


def main() -> None:
    """Write all files."""
    FOLDER.mkdir(exist_ok=True)
    for name, (extras, requirements) in environments().items():
        _pin(name, extras, requirements, sys.argv[1:])


if __name__ == "__main__":
    main()
