"""The settings of a project."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from composer.diagnostics import Diagnostic, Severity, shown
from composer.fast_dataclass import dataclass
from composer.project.rules import BAD_SETTING
from composer.project.sources import SettingsSource
from composer.schema import check_schema
from composer.source import Located, SourceFile
from composer.tree import Mapping, Scalar, Sequence

_SCHEMA = "project"


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a project. ``source`` is their file, or None without settings.

    ``nodes`` and ``interfaces`` are folders; None stands for the defaults. ``select``, ``ignore``
    and ``severity`` name rules by name, code or code prefix.
    """

    source: SourceFile | None = None
    nodes: tuple[Path, ...] | None = None
    interfaces: tuple[Path, ...] | None = None
    strict: bool = False
    select: tuple[Located[str], ...] = ()
    ignore: tuple[Located[str], ...] = ()
    severity: tuple[tuple[Located[str], Severity], ...] = ()


def read_settings(written: SettingsSource) -> tuple[Settings, list[Diagnostic]]:
    """Return the valid settings and the diagnostics."""
    tree = written.tree
    if tree is None:
        return Settings(written.source), []
    diagnostics = check_schema(tree, _SCHEMA)
    strict = tree.get("strict")
    settings = Settings(
        written.source,
        nodes=_folders(tree, "nodes", written.root, diagnostics),
        interfaces=_folders(tree, "interfaces", written.root, diagnostics),
        strict=isinstance(strict, Scalar) and strict.value is True,
        select=tuple(_texts(tree, "select")),
        ignore=tuple(_texts(tree, "ignore")),
        severity=tuple(_severities(tree)),
    )
    return settings, diagnostics


def _folders(
    tree: Mapping, name: str, root: Path, diagnostics: list[Diagnostic]
) -> tuple[Path, ...] | None:
    if not isinstance(tree.get(name), Sequence):
        return None
    found = []
    for text in _texts(tree, name):
        folder = root / text.value
        problem = _problem(folder, root)
        if problem is None:
            found.append(folder.resolve())
        else:
            message = f"'{shown(text.value)}' {problem}"
            hint = "use a folder below the folder of this file"
            diagnostics.append(Diagnostic(BAD_SETTING, message, text.span, hint=hint))
    return tuple(found)


def _problem(folder: Path, root: Path) -> str | None:
    try:
        if not folder.resolve().is_relative_to(root):
            return "is outside the project"
        return None if folder.is_dir() else "is not a folder"
    except (
        OSError,
        RuntimeError,
        ValueError,
    ):  # too long, a symbolic link loop or not a valid path
        return "is not a folder"


def _texts(tree: Mapping, name: str) -> Iterator[Located[str]]:
    items = tree.get(name)
    for item in items.items if isinstance(items, Sequence) else ():
        if isinstance(item, Scalar) and isinstance(item.value, str):
            yield Located(item.value, item.span)


def _severities(tree: Mapping) -> Iterator[tuple[Located[str], Severity]]:
    known = {severity.value: severity for severity in Severity}
    chosen = tree.get("severity")
    for entry in chosen if isinstance(chosen, Mapping) else ():
        if isinstance(entry.value, Scalar) and entry.value.value in known:
            severity = known[str(entry.value.value)]
            yield Located(entry.name, entry.key.span), severity
