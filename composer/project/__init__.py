"""What belongs together: a folder with its systems, node types and settings.

A project's root is the nearest folder with a ``composer.yaml``, or with a ``pyproject.toml`` that
has a table ``[tool.composer]``; without either the folder above the nearest ``nodes``, else the
folder itself. Nothing that a file refers to is read from outside of it, not through links either.
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
    """A project as seen from ``folder``, a folder in it. ``diagnostics`` are about its settings."""

    root: Path
    folder: Path
    settings: Settings = field(default_factory=Settings)
    diagnostics: tuple[Diagnostic, ...] = ()

    @classmethod
    def at(cls, folder: Path) -> Project:
        """Return the project that ``folder`` belongs to."""
        start = folder.resolve()
        found = find_settings(start)
        if found is None:
            nodes = _nearest(NODES, (start, *start.parents))
            return cls(start if nodes is None else nodes.parent, start)
        settings, diagnostics = read_settings(found)
        return cls(found.root, start, settings, (*found.diagnostics, *diagnostics))

    @property
    def node_folders(self) -> tuple[Path, ...]:
        """Where the project's node types are."""
        return self._folders(self.settings.nodes, NODES)

    @property
    def interface_folders(self) -> tuple[Path, ...]:
        """Where the sources of the project's interface packages are."""
        return self._folders(self.settings.interfaces, INTERFACES)

    def holds(self, path: Path) -> bool:
        """Say whether ``path`` is in the project, whatever links it leads through."""
        try:
            # Unlike Path.resolve, it takes a link to itself the same way on every Python.
            return Path(os.path.realpath(path)).is_relative_to(self.root)
        except (OSError, ValueError):  # no path at all
            return False

    def _folders(self, chosen: tuple[Path, ...] | None, usual: str) -> tuple[Path, ...]:
        if chosen is not None:
            return chosen
        nearest = _nearest(usual, self._ancestors())
        if nearest is None or (nearest.is_symlink() and not self.holds(nearest)):
            return ()
        return (nearest,)

    def _ancestors(self) -> Iterator[Path]:
        """Yield the folders from ``folder`` up to the root; to the top where there is no such."""
        for ancestor in (self.folder, *self.folder.parents):
            yield ancestor
            if ancestor == self.root and self.settings.source is not None:
                return


def _nearest(name: str, ancestors: Iterator[Path] | tuple[Path, ...]) -> Path | None:
    return next((above / name for above in ancestors if _has_folder(above, name)), None)


def _has_folder(folder: Path, name: str) -> bool:
    """Say so without a path: this is asked for every file, and of all folders above it."""
    return os.path.isdir(f"{folder}/{name}")  # noqa: PTH112
