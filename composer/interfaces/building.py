"""How to build an interface package."""

from __future__ import annotations

from pathlib import Path

from composer.source import shown_path


def how_to_build(package: str, folder: Path | None) -> str:
    """Return the command that builds and installs ``package``; ``folder`` has its source, if known.

    A package with a pyproject.toml can be built by pip, without colcon.
    """
    by_colcon = f"colcon build --packages-select {package}, then source install/setup.bash"
    if folder is None:
        return by_colcon
    if not (folder / "pyproject.toml").is_file():
        return f"compose interfaces build {package}   or: {by_colcon}"
    return f"pip install {shown_path(folder)}   or: {by_colcon}"
