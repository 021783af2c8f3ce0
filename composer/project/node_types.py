"""The node types and interface packages that a file may refer to by name.

Also those of projects that are installed as ROS packages. Such a package registers in the ament
index under the resource type ``ros2_composer``. Its node types and systems are in
``share/<package>/nodes`` and ``share/<package>/systems``. The packages of earlier prefixes of
AMENT_PREFIX_PATH come first, as in overlays of workspaces.
"""

from __future__ import annotations

import re
from collections.abc import Mapping as Map
from contextlib import suppress
from dataclasses import field
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.folders import TrustedUsers, ament_prefixes, interfaces_folder, nodes_folder
from composer.base.source import Span
from composer.project import Project

#: The resource type in the ament index.
RESOURCE_TYPE = "ros2_composer"
_INDEX = Path("share", "ament_index", "resource_index", RESOURCE_TYPE)
SUFFIX = ".yaml"
#: A node type is named by the stem of its file, which must not contain a path.
_TYPE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,199}")


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
        files = sorted((self.folder / "systems").glob(f"*{SUFFIX}"))
        return {file.stem: file.resolve() for file in files}


def installed_projects() -> tuple[InstalledProject, ...]:
    """Return the installed projects, each package once, but no projects of other users."""
    trusted = TrustedUsers.own()
    found: dict[str, InstalledProject] = {}
    for prefix in ament_prefixes():
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


def _registered(prefix: Path) -> list[str]:
    with suppress(OSError):
        return sorted(path.name for path in (prefix / _INDEX).iterdir() if path.is_file())
    return []


@dataclass(frozen=True, slots=True)
class NodeTypes:
    """The node types in the folders of a project; the first folder that has a name wins.

    ``installed`` are those of the folders that belong to installed packages.
    """

    folders: tuple[Path, ...]
    project: Project
    installed: frozenset[Path] = frozenset()

    @classmethod
    def of(cls, project: Project) -> NodeTypes:
        """Return the node types of ``project``, of installed packages, and the built-in ones."""
        installed = tuple(item.node_folder for item in installed_projects())
        folders = (*project.node_folders, *installed, nodes_folder().resolve())
        return cls(tuple(dict.fromkeys(folders)), project, frozenset(installed))

    def find(self, name: str) -> Path | None:
        """Return the file of the node type ``name``, or None."""
        path = self._file(name)
        return None if path is None or self._is_outside_project(path) else path

    def find_outside_project(self, name: str) -> Path | None:
        """Return the file of ``name`` if it is a symbolic link out of the project, else None."""
        path = self._file(name)
        return path if path is not None and self._is_outside_project(path) else None

    def names(self) -> tuple[str, ...]:
        """Return the names of all node types, sorted."""
        return tuple(
            sorted(
                {
                    path.stem
                    for folder in self.folders
                    for path in folder.glob(f"*{SUFFIX}")
                    if _TYPE_NAME.fullmatch(path.stem)
                }
            )
        )

    def _file(self, name: str) -> Path | None:
        if not _TYPE_NAME.fullmatch(name):
            return None
        for folder in self.folders:
            path = folder / f"{name}{SUFFIX}"
            if path.is_file():
                # With colcon's --symlink-install, the file and its behavior are in the sources.
                return path.resolve() if folder in self.installed else path
        return None

    def _is_outside_project(self, path: Path) -> bool:
        if not path.is_symlink() or path.parent == nodes_folder().resolve():
            return False
        return not self.project.holds(path)


def replaced_built_in_type(path: Path) -> Path | None:
    """Return the built-in node type in whose place the file ``path`` is used, or None."""
    folder = nodes_folder().resolve()
    built_in = folder / path.name
    return None if path.parent.resolve() == folder or not built_in.is_file() else built_in


def interface_folders(project: Project) -> tuple[Path, ...]:
    """Return the folders of interface packages: the project's, then the composer's own."""
    return tuple(dict.fromkeys((*project.interface_folders, interfaces_folder().resolve())))


@dataclass(frozen=True, slots=True)
class SourceFolders:
    """The folders of a system's files by name, and the node types that the files may use.

    ``home`` and ``node_types`` belong to the file of the system.
    """

    home: Path
    folders: Map[str, Path]
    node_types: NodeTypes
    _node_types_of: dict[Path, NodeTypes] = field(default_factory=dict, repr=False, compare=False)

    def folder(self, span: Span) -> Path:
        """Return the folder of the file of ``span``."""
        return self.folders.get(span.file.path, self.home)

    def node_types_for(self, span: Span) -> NodeTypes:
        """Return the node types that the file of ``span`` may use."""
        folder = self.folder(span)
        if folder == self.home:
            return self.node_types
        if folder not in self._node_types_of:
            self._node_types_of[folder] = NodeTypes.of(Project.at(folder))
        return self._node_types_of[folder]
