"""Projects: folders with systems, node types and settings.

The root of a project is the nearest folder with a ``composer.yaml``, or with a ``pyproject.toml``
that has the table ``[tool.composer]``; without either, the folder above the nearest ``nodes``
folder, or the folder itself. Files outside the project are never read, not even through symbolic
links.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from composer.diagnostics import Diagnostic
from composer.project.settings import Settings, read_settings
from composer.project.sources import SETTINGS_FILE, find_settings

__all__ = ["INTERFACES", "NODES", "SETTINGS_FILE", "Project", "Settings"]

NODES = "nodes"
INTERFACES = "interfaces"


@dataclass(frozen=True, slots=True)
class Project:
    """A project as seen from ``folder`` in it. ``diagnostics`` are about its settings."""

    root: Path
    folder: Path
    settings: Settings = field(default_factory=Settings)
    diagnostics: tuple[Diagnostic, ...] = ()

    @classmethod
    def at(cls, folder: Path) -> Project:
        """Return the project of ``folder``."""
        start = folder.resolve()
        found = find_settings(start)
        if found is None:
            nodes = _nearest(NODES, (start, *start.parents))
            return cls(start if nodes is None else nodes.parent, start)
        settings, diagnostics = read_settings(found)
        return cls(found.root, start, settings, (*found.diagnostics, *diagnostics))

    @property
    def node_folders(self) -> tuple[Path, ...]:
        """The folders of the project's node types."""
        return self._folders(self.settings.nodes, NODES)

    @property
    def interface_folders(self) -> tuple[Path, ...]:
        """The folders of the project's interface packages."""
        return self._folders(self.settings.interfaces, INTERFACES)

    def holds(self, path: Path) -> bool:
        """Return whether ``path`` is in the project after resolving symbolic links."""
        try:
            # Unlike Path.resolve, it handles symbolic link loops the same way on every Python.
            return Path(os.path.realpath(path)).is_relative_to(self.root)
        except (OSError, ValueError):  # not a valid path
            return False

    def _folders(self, chosen: tuple[Path, ...] | None, usual: str) -> tuple[Path, ...]:
        if chosen is not None:
            return chosen
        nearest = _nearest(usual, self._ancestors())
        if nearest is None or (nearest.is_symlink() and not self.holds(nearest)):
            return ()
        return (nearest,)

    def _ancestors(self) -> Iterator[Path]:
        """Yield the folders from ``folder`` up to the project root, or to the file system root."""
        for ancestor in (self.folder, *self.folder.parents):
            yield ancestor
            if ancestor == self.root and self.settings.source is not None:
                return


def _nearest(name: str, ancestors: Iterator[Path] | tuple[Path, ...]) -> Path | None:
    return next((above / name for above in ancestors if _has_folder(above, name)), None)


def _has_folder(folder: Path, name: str) -> bool:
    """Return whether a folder exists. Called for every file and every parent: avoids Path."""
    return os.path.isdir(f"{folder}/{name}")  # noqa: PTH112
