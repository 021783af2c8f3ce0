"""The node types and interface packages that a file may refer to by name."""

from __future__ import annotations

import re
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.resources import interfaces_folder, nodes_folder
from composer.project import Project
from composer.project.installed_projects import installed_projects

SUFFIX = ".yaml"

#: A node type is named by the stem of its file, which must not contain a path.
_TYPE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,199}")


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
