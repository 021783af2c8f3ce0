"""Which users' folders a search through parent folders may use.

A search reaches folders that other users can write to, such as /tmp. What it finds decides which
Python a system runs, so the owner is checked, as git does (``safe.directory``).
"""

from __future__ import annotations

import os
from pathlib import Path

from composer.base.fast_dataclass import dataclass

#: Folders that are used regardless of their owner, separated by colons; ``*`` stands for all.
SAFE_FOLDERS_VARIABLE = "COMPOSE_SAFE_FOLDERS"
_ALL = "*"
_ROOT = 0
_GONE = -1


@dataclass(frozen=True, slots=True)
class TrustedUsers:
    """The ids of the users whose folders a search may use, and folders to use in any case."""

    ids: frozenset[int]
    safe_folders: frozenset[str] = frozenset()

    @classmethod
    def own(cls) -> TrustedUsers:
        """Return this user and root; with sudo, also the user who called it."""
        ids = {_ROOT, os.geteuid()}
        caller = os.environ.get("SUDO_UID", "")
        if os.geteuid() == _ROOT and caller.isascii() and caller.isdigit():
            ids.add(int(caller))
        listed = os.environ.get(SAFE_FOLDERS_VARIABLE, "").split(os.pathsep)
        safe = (text if text == _ALL else os.path.realpath(text) for text in listed if text)
        return cls(frozenset(ids), frozenset(safe))

    @classmethod
    def starting_at(cls, folder: Path) -> TrustedUsers:
        """Return the trusted users for a search that starts in ``folder``.

        The owner of that folder is among them: the user has chosen it, and its owner decides what
        the files in it are.
        """
        own = cls.own()
        try:
            return cls(own.ids | {folder.stat().st_uid}, own.safe_folders)
        except OSError:
            return own

    def other_owner(self, found: Path) -> int | None:
        """Return the user, not a trusted one, who owns ``found`` or the folder that it is in."""
        if self.safe_folders and not self.safe_folders.isdisjoint({_ALL, str(found.parent)}):
            return None
        owners = (_owner(found.parent), _owner(found, follow=False), _owner(found))
        return next((owner for owner in owners if owner not in self.ids and owner != _GONE), None)


def _owner(path: Path, *, follow: bool = True) -> int:
    try:
        return path.stat(follow_symlinks=follow).st_uid
    except OSError:  # removed in the meantime, or the target of a symbolic link is missing
        return _GONE
