"""Where a project keeps its settings, read as a located tree."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from composer.diagnostics import Diagnostic, Label
from composer.document import read_document
from composer.document.files import decode, read_bytes
from composer.document.rules import NOT_A_MAP, UNREADABLE_FILE
from composer.project.rules import BAD_SETTING
from composer.project.toml import TABLE, read_table
from composer.source import SourceFile, Span, shown_path
from composer.tree import Mapping

SETTINGS_FILE = "composer.yaml"
PYPROJECT_FILE = "pyproject.toml"


@dataclass(frozen=True, slots=True)
class SettingsSource:
    """Settings as they are written. ``tree`` is None where too little of them can be read."""

    root: Path
    source: SourceFile
    tree: Mapping | None
    diagnostics: tuple[Diagnostic, ...]


def find_settings(folder: Path) -> SettingsSource | None:
    """Return the settings of the nearest of ``folder`` and the folders above that has any."""
    # Asked of every file, and for all folders above it: a Path for each is what takes time.
    root = str(folder)
    while True:
        own, table = _stamp(f"{root}/{SETTINGS_FILE}"), _stamp(f"{root}/{PYPROJECT_FILE}")
        written = _written(root or "/", own, table) if own or table else None
        if written is not None or not root.strip("/"):
            return written
        root = root.rpartition("/")[0]


_Stamp: TypeAlias = tuple[int, int]


def _stamp(path: str) -> _Stamp | None:
    """Return what changes when a file does; None where there is none."""
    try:
        status = os.lstat(path)
    except OSError:  # also for a folder that may not be looked into
        return None
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=32)
def _written(
    folder: str, own_stamp: _Stamp | None, table_stamp: _Stamp | None
) -> SettingsSource | None:
    """Read what is in ``folder``: once while it stays so, for every file of a project asks."""
    root = Path(folder)
    own = _own_file(root) if own_stamp is not None else None
    table = _table(root) if table_stamp is not None else None
    if own is None or table is None:
        return own or table
    return _both(own, table)


def _own_file(root: Path) -> SettingsSource:
    path = root / SETTINGS_FILE
    name = shown_path(path)
    if not _is_inside(path, root):
        source = SourceFile(name)
        message = "this is a symbolic link out of the project"
        return SettingsSource(
            root, source, None, (Diagnostic(UNREADABLE_FILE, message, _start(source)),)
        )
    tree, source, diagnostics = read_document(path, name)
    if [diagnostic.rule for diagnostic in diagnostics] == [NOT_A_MAP] and _says_nothing(source):
        return SettingsSource(root, source, Mapping((), _start(source)), ())
    return SettingsSource(root, source, tree, tuple(diagnostics))


def _table(root: Path) -> SettingsSource | None:
    path = root / PYPROJECT_FILE
    if not _is_inside(path, root):
        return None
    name = shown_path(path)
    data, unread = read_bytes(path, SourceFile(name))
    source, undecoded = decode(data, name)
    read = None if unread or undecoded else read_table(source)
    if read is None:
        return None
    tree, diagnostics = read
    return SettingsSource(root, source, tree, tuple(diagnostics))


def _both(own: SettingsSource, table: SettingsSource) -> SettingsSource:
    """Keep the file, and say that the table is not read."""
    span = table.tree.span if table.tree is not None else _start(table.source)
    diagnostic = Diagnostic(
        BAD_SETTING,
        f"the table {TABLE} is not read: there is a {SETTINGS_FILE} beside it",
        span,
        (Label(_start(own.source), "these are the settings"),),
        "keep one of the two",
    )
    return replace(own, diagnostics=(*own.diagnostics, diagnostic))


def _is_inside(path: Path, root: Path) -> bool:
    try:
        return path.resolve().is_relative_to(root)
    except (OSError, RuntimeError):  # a link to itself
        return False


def _says_nothing(source: SourceFile) -> bool:
    return all(not line.strip() or line.lstrip().startswith("#") for line in source.lines)


def _start(source: SourceFile) -> Span:
    return Span(source, 1, 1)
