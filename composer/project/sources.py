"""Find and read the settings file of a project."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from composer.diagnostics import Diagnostic, Label
from composer.document import read_document
from composer.document.files import decode, read_bytes
from composer.document.rules import NOT_A_MAP, UNREADABLE_FILE
from composer.fast_dataclass import dataclass
from composer.project.rules import BAD_SETTING
from composer.project.toml import TABLE, read_table
from composer.source import SourceFile, Span, shown_path
from composer.tree import Mapping

SETTINGS_FILE = "composer.yaml"
PYPROJECT_FILE = "pyproject.toml"


@dataclass(frozen=True, slots=True)
class SettingsSource:
    """Settings as a located tree. ``tree`` is None if they cannot be read."""

    root: Path
    source: SourceFile
    tree: Mapping | None
    diagnostics: tuple[Diagnostic, ...]


def find_settings(folder: Path) -> SettingsSource | None:
    """Return the settings in ``folder`` or the nearest parent that has any."""
    # Called for every file and every parent: a Path for each would be slow.
    root = str(folder)
    while True:
        own, table = _stamp(f"{root}/{SETTINGS_FILE}"), _stamp(f"{root}/{PYPROJECT_FILE}")
        settings = _read_settings(root or "/", own, table) if own or table else None
        if settings is not None or not root.strip("/"):
            return settings
        root = root.rpartition("/")[0]


_Stamp: TypeAlias = tuple[int, int]


def _stamp(path: str) -> _Stamp | None:
    """Return a value that changes when the file does; None if it does not exist."""
    try:
        status = os.lstat(path)
    except OSError:  # also for folders without permission
        return None
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=32)
def _read_settings(
    folder: str, own_stamp: _Stamp | None, table_stamp: _Stamp | None
) -> SettingsSource | None:
    """Read the settings in ``folder``, again only if a file has changed."""
    root = Path(folder)
    own = _own_file(root) if own_stamp is not None else None
    table = _table(root) if table_stamp is not None else None
    if own is None or table is None:
        return own or table
    return _prefer_file(own, table)


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
    if [diagnostic.rule for diagnostic in diagnostics] == [NOT_A_MAP] and _is_empty(source):
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


def _prefer_file(own: SettingsSource, table: SettingsSource) -> SettingsSource:
    """Return the file's settings, with a diagnostic that the table is ignored."""
    span = table.tree.span if table.tree is not None else _start(table.source)
    diagnostic = Diagnostic(
        BAD_SETTING,
        f"the table {TABLE} is ignored: the folder also has a {SETTINGS_FILE}",
        span,
        (Label(_start(own.source), "these settings are used"),),
        "keep one of the two",
    )
    return replace(own, diagnostics=(*own.diagnostics, diagnostic))


def _is_inside(path: Path, root: Path) -> bool:
    try:
        return path.resolve().is_relative_to(root)
    except (OSError, RuntimeError):  # a symbolic link loop
        return False


def _is_empty(source: SourceFile) -> bool:
    return all(not line.strip() or line.lstrip().startswith("#") for line in source.lines)


def _start(source: SourceFile) -> Span:
    return Span(source, 1, 1)
