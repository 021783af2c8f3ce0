"""Projects that are installed as ROS packages: their node types and systems.

A package registers in the ament index under the resource type ``ros2_composer``. Its node types and
systems are in ``share/<package>/nodes`` and ``share/<package>/systems``. The packages of earlier
prefixes of AMENT_PREFIX_PATH come first, as in overlays of workspaces.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.ownership import TrustedUsers

#: The resource type in the ament index.
RESOURCE_TYPE = "ros2_composer"
_INDEX = Path("share", "ament_index", "resource_index", RESOURCE_TYPE)
_SUFFIX = ".yaml"


@dataclass(frozen=True, slots=True)
class InstalledProject:
    """A package with node types and systems. ``folder`` is its share folder."""

    package: str
    folder: Path

    @property
    def node_folder(self) -> Path:
        """The folder of its node types, which need not exist."""
        return self.folder / "nodes"

    def systems(self) -> dict[str, Path]:
        """Return its system files by name.

        ``colcon build --symlink-install`` makes links: these are the files that they lead to.
        """
        files = sorted((self.folder / "systems").glob(f"*{_SUFFIX}"))
        return {file.stem: file.resolve() for file in files}


def installed_projects() -> tuple[InstalledProject, ...]:
    """Return the installed projects, each package once, without those of other users."""
    trusted = TrustedUsers.own()
    found: dict[str, InstalledProject] = {}
    for prefix in _prefixes():
        for package in _registered(prefix):
            folder = prefix / "share" / package
            if package not in found and trusted.other_owner(folder) is None:
                found[package] = InstalledProject(package, folder)
    return tuple(found.values())


def installed_systems() -> dict[str, Path]:
    """Return the systems of installed projects, by name and by ``package/name``.

    Of systems with the same name, the first one is used.
    """
    found: dict[str, Path] = {}
    for project in installed_projects():
        for name, path in project.systems().items():
            found.setdefault(name, path)
            found[f"{project.package}/{name}"] = path
    return found


def _prefixes() -> Iterator[Path]:
    listed = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    yield from map(Path, dict.fromkeys((*filter(None, listed), sys.prefix)))


def _registered(prefix: Path) -> list[str]:
    with suppress(OSError):
        return sorted(path.name for path in (prefix / _INDEX).iterdir() if path.is_file())
    return []
