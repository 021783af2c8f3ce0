"""Which files of a folder are ours: systems and node types, among whatever else is there."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from composer.diagnostics import Diagnostic
from composer.document.rules import UNREADABLE_FILE
from composer.project import SETTINGS_FILE, Project
from composer.source import SourceFile, Span

_SUFFIXES = frozenset({".yaml", ".yml"})
#: The first line that says something, in a file of ours.
_MARKER = re.compile(r"""\{?\s*["']?(system|node)["']?\s*:(\s|$)""")
#: A line further down that says the same, with a name: in other files, these words begin maps.
_LATER_MARKER = re.compile(r"""^(system|node):[ \t]+["']?\w""", re.MULTILINE)
#: As much of a file as may be licence and comments before its first key.
_HEAD_BYTES = 65_536
#: Folders that tools made: environments, what colcon built, packages of others.
_FOREIGN_FOLDERS = frozenset({"__pycache__", "node_modules", "site-packages"})
_FOREIGN_FOLDER_MARKS = frozenset({"AMENT_IGNORE", "COLCON_IGNORE", "pyvenv.cfg"})


@dataclass(frozen=True, slots=True)
class Found:
    """The files under some paths.

    ``files`` are to be looked at: those that were named, and in folders the systems and node types.
    ``foreign`` are YAML files in folders that are something else. ``findings`` are about links in
    folders that lead out of the project: they are not followed.
    """

    files: tuple[Path, ...]
    foreign: tuple[Path, ...]
    findings: tuple[Diagnostic, ...]


def find_files(paths: Iterable[Path]) -> Found:
    """Find the files to look at.

    In a folder, files that do not say ``system:`` or ``node:`` are left alone, and so are links to
    folders, hidden folders, and those that tools made. A path that does not exist is among the
    files, for whoever reads it to say so.
    """
    search = _Search()
    for path in paths:
        if _is_folder(path):
            search.look_below(path)
        else:
            search.files[path] = None
    return Found(tuple(search.files), tuple(search.foreign), tuple(search.findings))


@dataclass(slots=True)
class _Search:
    files: dict[Path, None] = field(default_factory=dict)
    foreign: dict[Path, None] = field(default_factory=dict)
    findings: list[Diagnostic] = field(default_factory=list)

    def look_below(self, folder: Path) -> None:
        project = Project.at(folder)
        for path in sorted(self._yaml_files(folder)):
            if path.name == SETTINGS_FILE or not _is_regular(path):
                continue  # settings are not looked at, but kept to
            if path.is_symlink() and not project.holds(path):
                self.findings.append(_stray(path))
            else:
                (self.files if _is_ours(path) else self.foreign)[path] = None

    def _yaml_files(self, folder: Path) -> Iterator[Path]:
        for parent, folders, files in os.walk(folder, onerror=self._note_unreadable):
            if _FOREIGN_FOLDER_MARKS.isdisjoint(files) or Path(parent) == folder:
                folders[:] = [name for name in folders if _is_searched(name)]
                yield from (Path(parent, name) for name in files if _has_suffix(name))
            else:
                folders.clear()

    def _note_unreadable(self, error: OSError) -> None:
        why = f"this folder cannot be read: {error.strerror}"
        self.findings.append(
            Diagnostic(UNREADABLE_FILE, why, Span(SourceFile(str(Path(error.filename))), 1, 1))
        )


def _is_searched(folder_name: str) -> bool:
    return not folder_name.startswith(".") and folder_name not in _FOREIGN_FOLDERS


def _has_suffix(name: str) -> bool:
    return not name.startswith(".") and Path(name).suffix in _SUFFIXES


def _stray(path: Path) -> Diagnostic:
    return Diagnostic(
        UNREADABLE_FILE,
        "this is a link that leads out of the project",
        Span(SourceFile(str(path)), 1, 1),
        hint="copy the file it leads to",
    )


def _is_ours(path: Path) -> bool:
    """Say whether a file is for the composer, without parsing what may be foreign."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    except OSError:
        return True  # whoever reads it says why it cannot be read
    first = next((line for line in head.splitlines() if _says_something(line)), "")
    return _MARKER.match(first) is not None or _LATER_MARKER.search(head) is not None


def _says_something(line: str) -> bool:
    return bool(line.strip()) and not line.startswith(("#", "%", "---"))


def _is_regular(path: Path) -> bool:
    """Say whether ``path`` can be opened without waiting for somebody at its other end."""
    try:
        return stat.S_ISREG(path.stat().st_mode)
    except OSError:
        return False


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):  # too long, or not a path at all: told when it is read
        return False
