"""Files in folders: where node types are found, and which files of a folder are ours."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from composer.resources import interfaces_folder, nodes_folder

NODES = "nodes"
INTERFACES = "interfaces"
SUFFIX = ".yaml"

_SUFFIXES = frozenset({".yaml", ".yml"})
#: A node type's name is a file's stem, and must not lead anywhere else.
_TYPE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,199}")
#: The first line that says something, in a file of ours.
_MARKER = re.compile(r"""\{?\s*["']?(system|node)["']?\s*:(\s|$)""")
#: As much of a file as may be licence and comments before its first key.
_HEAD_BYTES = 65_536


@dataclass(frozen=True, slots=True)
class Catalog:
    """The node types that a file may use by name. Of two folders that have one, the first wins."""

    folders: tuple[Path, ...]

    @classmethod
    def for_file(cls, path: Path) -> Catalog:
        """Return the types of the project that ``path`` belongs to, and the composer's own."""
        project = project_nodes(path.parent)
        found = (project,) if project is not None else ()
        return cls(tuple(dict.fromkeys((*found, nodes_folder().resolve()))))

    def find(self, name: str) -> Path | None:
        """Return the file of the node type called ``name``, or None."""
        if not _TYPE_NAME.fullmatch(name):
            return None
        candidates = (folder / f"{name}{SUFFIX}" for folder in self.folders)
        return next((path for path in candidates if _is_inside(path)), None)

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


def project_nodes(folder: Path) -> Path | None:
    """Return the ``nodes`` folder of the project that ``folder`` belongs to, or None."""
    return _nearest(NODES, folder)


def interface_folders(folder: Path) -> tuple[Path, ...]:
    """Return where sources of interface packages are: the project's, then the composer's own."""
    project = _nearest(INTERFACES, folder)
    found = (project,) if project is not None else ()
    return tuple(dict.fromkeys((*found, interfaces_folder().resolve())))


def find_files(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the files to look at: those named, and below each folder every system and node type.

    In a folder, files that do not begin with ``system:`` or ``node:`` are left alone, and so are
    hidden folders and links to folders. A path that does not exist is returned, for whoever
    reads it to say so.
    """
    found: dict[Path, None] = {}
    for path in paths:
        if _is_folder(path):
            found.update(dict.fromkeys(sorted(_ours_below(path))))
        else:
            found[path] = None
    return tuple(found)


def shown_path(path: Path) -> str:
    """Return ``path`` as people know it: relative to the current folder where it is below it."""
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except (OSError, ValueError):
        return str(path)


def _nearest(name: str, folder: Path) -> Path | None:
    """Return the folder called ``name`` in the nearest of ``folder`` and its ancestors."""
    start = folder.resolve()
    candidates = (ancestor / name for ancestor in (start, *start.parents))
    return next((path for path in candidates if _is_folder(path)), None)


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):  # too long, or not a path at all: told when it is read
        return False


def _is_inside(path: Path) -> bool:
    """Say whether ``path`` is a regular file that no link leads out of its folder."""
    return path.is_file() and path.resolve().parent == path.parent.resolve()


def _ours_below(folder: Path) -> Iterator[Path]:
    for parent, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        for name in files:
            path = Path(parent, name)
            if path.suffix in _SUFFIXES and _is_ours(path):
                yield path


def _is_ours(path: Path) -> bool:
    """Say whether the first key of a file is one of ours, without parsing what may be foreign."""
    if not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    except OSError:
        return False
    for line in head.splitlines():
        if line.strip() and not line.startswith(("#", "%", "---")):
            return _MARKER.match(line) is not None
    return False
