"""The folders of the package and of ROS, and the users whose files a search may trust.

Data files are JSON Schemas, node types, systems, interfaces and pages of rules. A wheel has them in
``composer/share/`` (see pyproject.toml). In a checkout or an editable install, they are next to the
package.

A search through parent folders reaches folders that other users can write to, such as /tmp. What it
finds decides which Python a system runs, so the owner is checked, as git does
(``safe.directory``).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from composer.base.fast_dataclass import dataclass

PACKAGE = Path(__file__).resolve().parents[1]
#: Folders that are used regardless of their owner, separated by colons; ``*`` stands for all.
SAFE_FOLDERS_VARIABLE = "COMPOSE_SAFE_FOLDERS"
_ALL = "*"
_ROOT = 0
_GONE = -1


def data_folder() -> Path:
    """Return the folder that the other ones are in."""
    share = PACKAGE / "share"
    # The wheel first: `nodes` next to an installed package would belong to another distribution.
    return share if share.is_dir() else PACKAGE.parent


def schemas_folder() -> Path:
    """Return the folder of the JSON Schemas."""
    return data_folder() / "schemas"


def nodes_folder() -> Path:
    """Return the folder of the node types that come with the composer."""
    return data_folder() / "nodes"


def systems_folder() -> Path:
    """Return the folder of the example systems."""
    return data_folder() / "systems"


def interfaces_folder() -> Path:
    """Return the source of the ament package composer_interfaces (.srv and .action files)."""
    return data_folder() / "interfaces"


def rules_folder() -> Path:
    """Return the folder of the pages about rules, ``docs/rules`` in a checkout."""
    in_wheel = data_folder() / "rules"
    return in_wheel if in_wheel.is_dir() else data_folder() / "docs/rules"


def ament_prefixes(environment: Mapping[str, str] = os.environ) -> list[Path]:
    """Return the prefixes that ROS searches: ``AMENT_PREFIX_PATH``, then this Python's."""
    listed = environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return [Path(prefix) for prefix in dict.fromkeys((*filter(None, listed), sys.prefix))]


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
