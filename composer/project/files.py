"""Find systems, node types and scenarios among the files of a folder."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import field
from pathlib import Path

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.files import open_regular
from composer.base.source import SourceFile, Span
from composer.language.rules import UNREADABLE_FILE
from composer.project import SETTINGS_FILE, Project

_SUFFIXES = frozenset({".yaml", ".yml"})
#: The first line with content in a system, node type or scenario.
_MARKER = re.compile(r"""\{?\s*["']?(system|node|scenario)["']?\s*:(\s|$)""")
#: A later line with the same key and a name. In other files, these keys begin maps.
_LATER_MARKER = re.compile(r"""^(system|node|scenario):[ \t]+["']?\w""", re.MULTILINE)
#: The beginning of a ROS parameter file for a node named 'node' or 'system'.
_PARAMETERS = re.compile(r"""["']?\w+["']?:\s*\{?\s*["']?ros__parameters\b""")
#: What only systems and node types have together: a section of theirs, and the type of a port.
_SECTION = re.compile(r"^(nodes|publishers|subscriptions|timers):\s", re.MULTILINE)
_INTERFACE = re.compile(r"\btype:\s*[\"']?[a-z]\w*/(msg|srv|action)/[A-Z]")
#: The part of a file that may hold a license and comments before the first key.
_HEAD_BYTES = 65_536
#: Folders made by tools: environments, colcon builds, installed packages.
_FOREIGN_FOLDERS = frozenset({"__pycache__", "node_modules", "site-packages"})
_FOREIGN_FOLDER_MARKS = frozenset({"AMENT_IGNORE", "COLCON_IGNORE", "pyvenv.cfg"})


@dataclass(frozen=True, slots=True)
class FoundFiles:
    """The files below some paths.

    ``files`` are those that were named, and the systems and node types in folders. ``foreign`` are
    other YAML files in these folders. ``diagnostics`` are about symbolic links out of the project,
    which are not followed.
    """

    files: tuple[Path, ...]
    foreign: tuple[Path, ...]
    diagnostics: tuple[Diagnostic, ...]


def find_files(paths: Iterable[Path]) -> FoundFiles:
    """Find the files to check.

    In folders, this skips files without ``system:`` or ``node:`` that have nothing of either,
    symbolic links to folders, hidden folders and folders made by tools. A path that does not exist
    is among the files: reading it reports the error.
    """
    search = _Search()
    for path in paths:
        if os.path.isdir(path):  # noqa: PTH112 - false also for a path that is not valid
            search.search_folder(path)
        else:
            search.files[path] = None
    return FoundFiles(tuple(search.files), tuple(search.foreign), tuple(search.diagnostics))


@dataclass(slots=True)
class _Search:
    files: dict[Path, None] = field(default_factory=dict)
    foreign: dict[Path, None] = field(default_factory=dict)
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def search_folder(self, folder: Path) -> None:
        project = Project.at(folder)
        for path in sorted(self._yaml_files(folder)):
            if path.name == SETTINGS_FILE:
                continue  # settings are not checked as a file of their own
            if not os.path.isfile(path):  # noqa: PTH113 - false also without the permission
                continue
            if path.is_symlink() and not project.holds(path):
                self.diagnostics.append(_link_out_of_project(path))
            else:
                (self.files if _is_composer_file(path) else self.foreign)[path] = None

    def _yaml_files(self, folder: Path) -> Iterator[Path]:
        """Yield the YAML files below ``folder``. Unlike os.walk, this needs no recursion."""
        pending = [folder]
        while pending:
            parent = pending.pop()
            folders, files = self._list(parent)
            if _FOREIGN_FOLDER_MARKS.isdisjoint(files) or parent == folder:
                pending += (parent / name for name in folders if _is_searched(name))
                yield from (parent / name for name in files if _has_suffix(name))

    def _list(self, folder: Path) -> tuple[list[str], list[str]]:
        """Return the names of the folders and of the other entries of ``folder``."""
        folders: list[str] = []
        others: list[str] = []
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    is_folder = entry.is_dir(follow_symlinks=False)
                    (folders if is_folder else others).append(entry.name)
        except OSError as error:
            self._note_unreadable(folder, error)
        return folders, others

    def _note_unreadable(self, folder: Path, error: OSError) -> None:
        why = f"this folder cannot be read: {error.strerror}"
        span = Span(SourceFile(str(folder)), 1, 1)
        self.diagnostics.append(Diagnostic(UNREADABLE_FILE, why, span))


def _is_searched(folder_name: str) -> bool:
    return not folder_name.startswith(".") and folder_name not in _FOREIGN_FOLDERS


def _has_suffix(name: str) -> bool:
    return not name.startswith(".") and Path(name).suffix in _SUFFIXES


def _link_out_of_project(path: Path) -> Diagnostic:
    return Diagnostic(
        UNREADABLE_FILE,
        "this is a symbolic link out of the project",
        Span(SourceFile(str(path)), 1, 1),
        hint="copy the file it points to",
    )


def _is_composer_file(path: Path) -> bool:
    """Return whether a file is a system or node type, without parsing it."""
    try:
        with open_regular(path) as file:
            head = file.read(_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    except OSError:
        return True  # reading it reports the error
    content = "\n".join(line for line in head.splitlines() if _has_content(line))
    if _PARAMETERS.match(content) is not None:
        return False
    if _MARKER.match(content) is not None or _LATER_MARKER.search(head) is not None:
        return True
    return _SECTION.search(head) is not None and _INTERFACE.search(head) is not None


def _has_content(line: str) -> bool:
    return bool(line.strip()) and not line.startswith(("#", "%", "---"))
