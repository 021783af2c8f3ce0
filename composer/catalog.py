"""Where what a file refers to by name is found: node types, and interface packages."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from composer.project import Project
from composer.resources import interfaces_folder, nodes_folder

SUFFIX = ".yaml"

#: A node type's name is a file's stem, and must not lead anywhere else.
_TYPE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,199}")


@dataclass(frozen=True, slots=True)
class Catalog:
    """The node types that a file may use by name. Of two folders that have one, the first wins."""

    folders: tuple[Path, ...]
    project: Project

    @classmethod
    def for_file(cls, path: Path) -> Catalog:
        """Return what the file at ``path`` may use."""
        return cls.of(Project.at(path.parent))

    @classmethod
    def of(cls, project: Project) -> Catalog:
        """Return the types of ``project``, and the composer's own."""
        folders = (*project.node_folders, nodes_folder().resolve())
        return cls(tuple(dict.fromkeys(folders)), project)

    def find(self, name: str) -> Path | None:
        """Return the file of the node type called ``name``, or None."""
        path = self._file(name)
        return None if path is None or self._leads_out(path) else path

    def stray(self, name: str) -> Path | None:
        """Return what would be the file of ``name`` if it were no link out of the project."""
        path = self._file(name)
        return path if path is not None and self._leads_out(path) else None

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
        candidates = (folder / f"{name}{SUFFIX}" for folder in self.folders)
        return next((path for path in candidates if path.is_file()), None)

    def _leads_out(self, path: Path) -> bool:
        if not path.is_symlink() or path.parent == nodes_folder().resolve():
            return False
        return not self.project.holds(path)


def interface_folders(project: Project) -> tuple[Path, ...]:
    """Return where sources of interface packages are: the project's, then the composer's own."""
    return tuple(dict.fromkeys((*project.interface_folders, interfaces_folder().resolve())))
