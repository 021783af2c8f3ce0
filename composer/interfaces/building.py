"""How to build an interface package."""

from __future__ import annotations

from pathlib import Path

from composer.interfaces.sources import Bundle
from composer.source import shown_path


def _debian_name(package: str) -> str:
    return f"ros-jazzy-{package.replace('_', '-')}"


def how_to_build(package: str, folder: Path | None) -> str:
    """Return the command that builds and installs ``package``; ``folder`` has its source, if known.

    A package with a pyproject.toml can be built by pip, without colcon. Without a source, packages
    of ROS are built from the definitions that come with the composer.
    """
    by_colcon = f"colcon build --packages-select {package}, then source install/setup.bash"
    if folder is None:
        if package not in Bundle().packages():
            return by_colcon
        return f"compose interfaces build {package}   or: apt install {_debian_name(package)}"
    if not (folder / "pyproject.toml").is_file():
        return f"compose interfaces build {package}   or: {by_colcon}"
    return f"pip install {shown_path(folder)}   or: {by_colcon}"
