"""Projects: folders with systems, node types and settings.

The root of a project is the nearest folder with a ``composer.yaml``; without one, the folder above
the nearest ``nodes`` folder, else above the nearest ``interfaces`` folder, else above the nearest
``systems`` folder, or the folder itself. Files outside the project are never read, not even through
symbolic links.

The search ends where it finds something that belongs to another user: see
:mod:`composer.base.folders`.
"""

from __future__ import annotations

import os
import pwd
from dataclasses import field
from pathlib import Path

from composer.base.diagnostics import Diagnostic, shown
from composer.base.fast_dataclass import dataclass
from composer.base.folders import SAFE_FOLDERS_VARIABLE, TrustedUsers, data_folder
from composer.base.source import SourceFile, Span, shown_path
from composer.project.settings import (
    FOREIGN_OWNER,
    SETTINGS_FILE,
    Settings,
    SettingsSource,
    find_settings,
    is_inside,
    read_settings,
)

__all__ = ["INTERFACES", "NODES", "OUTSIDE_HINT", "SETTINGS_FILE", "SYSTEMS", "Project", "Settings"]

#: For messages about files outside the project.
OUTSIDE_HINT = "a file composer.yaml, which may be empty, marks the root of a project"

SYSTEMS = "systems"
NODES = "nodes"
INTERFACES = "interfaces"


@dataclass(frozen=True, slots=True)
class Project:
    """A project as seen from ``folder`` in it.

    ``node_folders`` and ``interface_folders`` are the folders of its node types and interface
    packages. ``diagnostics`` are about its settings, and about folders of other users.
    """

    root: Path
    folder: Path
    settings: Settings = field(default_factory=Settings)
    node_folders: tuple[Path, ...] = ()
    interface_folders: tuple[Path, ...] = ()
    diagnostics: tuple[Diagnostic, ...] = ()

    @classmethod
    def at(cls, folder: Path) -> Project:
        """Return the project of ``folder``."""
        start = folder.resolve()
        search = _Search(start, (start, *start.parents))
        declared = None if _is_bundled(start) else search.settings()
        if declared is None:
            return _without_settings(search)
        settings, diagnostics = read_settings(declared)
        search.end_above(declared.root)
        nodes = search.folders(NODES, settings.nodes)
        interfaces = search.folders(INTERFACES, settings.interfaces)
        found = (*search.diagnostics, *declared.diagnostics, *diagnostics)
        return cls(declared.root, start, settings, nodes, interfaces, found)

    @property
    def is_declared(self) -> bool:
        """Whether settings say what the root of the project is."""
        return self.settings.source is not None

    def holds(self, path: Path) -> bool:
        """Return whether ``path`` is in the project after resolving symbolic links."""
        return is_inside(path, self.root)


@dataclass(slots=True)
class _Search:
    """A search through ``ancestors``, nearest first.

    The last of them is the root of the project, or of the file system. ``diagnostics`` are about
    what is not used because of its owner; the search ends below it.
    """

    start: Path
    ancestors: tuple[Path, ...]
    diagnostics: tuple[Diagnostic, ...] = ()

    def settings(self) -> SettingsSource | None:
        found = find_settings(self.start)
        if found is not None and self._may_use(found.root / Path(found.source.path).name):
            return found
        return None

    def nearest(self, name: str) -> Path | None:
        for above in self.ancestors:
            if _has_folder(above, name):
                found = above / name
                return found if self._may_use(found) else None
        return None

    def own(self, name: str) -> Path | None:
        """Return the nearest folder of that name that holds the start of the search."""
        found = next((above for above in self.ancestors if above.name == name), None)
        return found if found is not None and self._may_use(found) else None

    def folders(self, name: str, chosen: tuple[Path, ...] | None = None) -> tuple[Path, ...]:
        """Return the folders that the settings choose, by default the nearest of that name."""
        if chosen is not None:
            return chosen
        found = self.nearest(name)
        if found is None or (found.is_symlink() and not is_inside(found, self.ancestors[-1])):
            return ()
        return (found,)

    def end_above(self, root: Path) -> None:
        self.ancestors = tuple(above for above in self.ancestors if above.is_relative_to(root))

    def _may_use(self, found: Path) -> bool:
        """Return whether a trusted user owns ``found``; end the search below it otherwise."""
        owner = TrustedUsers.starting_at(self.start).other_owner(found)
        if owner is None:
            return True
        self.diagnostics += (_foreign_owner(found, owner),)
        depth = len(self.start.parents) - len(found.parent.parents)
        self.ancestors = self.ancestors[:depth]
        return False


def _without_settings(search: _Search) -> Project:
    guess = search.nearest(NODES) or search.nearest(INTERFACES) or search.own(SYSTEMS)
    root = search.start if guess is None else guess.parent
    search.end_above(root)
    nodes, interfaces = search.folders(NODES), search.folders(INTERFACES)
    return Project(root, search.start, Settings(), nodes, interfaces, search.diagnostics)


def _foreign_owner(found: Path, owner: int) -> Diagnostic:
    return Diagnostic(
        FOREIGN_OWNER,
        f"'{shown(found.name)}' is not used: user {_user(owner)} controls it",
        Span(SourceFile(shown_path(found)), 1, 1),
        hint=f"if you trust that user, set {SAFE_FOLDERS_VARIABLE}={shown(found.parent)}",
    )


def _user(user_id: int) -> str:
    try:
        return f"'{pwd.getpwuid(user_id).pw_name}'"
    except KeyError:  # not of this computer, or of another container
        return str(user_id)


def _is_bundled(folder: Path) -> bool:
    """Return whether ``folder`` comes with the composer, so that no settings above it apply."""
    bundled = data_folder()
    return any(folder.is_relative_to(bundled / name) for name in (NODES, SYSTEMS))


def _has_folder(folder: Path, name: str) -> bool:
    """Return whether a folder exists. Called for every file and every parent: avoids Path."""
    return os.path.isdir(f"{folder}/{name}")  # noqa: PTH112
