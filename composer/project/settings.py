"""The settings of a project, from the nearest ``composer.yaml``, and the rules that they select."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from composer.base.diagnostics import Diagnostic, Rule, Severity, error, shown, suggestion, warning
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span, shown_path
from composer.language.document import read_document
from composer.language.rules import UNREADABLE_FILE, YAML_SYNTAX
from composer.language.schema import check_schema
from composer.language.tree import Mapping, Sequence, entries, flag, key, plain_text, texts

BAD_SETTING = error("RC042", "bad-setting")
FOREIGN_OWNER = warning("RC044", "foreign-owner")

SETTINGS_FILE = "composer.yaml"

_SCHEMA = "project"
_MISSING = "does not exist"
#: In one setting. There are fewer rules, each with a code and a name.
_MAX_RULES = 500
_Item = TypeVar("_Item", Located[str], tuple[Located[str], Severity])
_WORDS = {Severity.WARNING: "a warning", Severity.INFO: "an info"}


@dataclass(frozen=True, slots=True)
class SettingsSource:
    """The settings file in ``root`` as a located tree. ``tree`` is None if it cannot be read."""

    root: Path
    source: SourceFile
    tree: Mapping | None
    diagnostics: tuple[Diagnostic, ...]


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


def find_settings(folder: Path) -> SettingsSource | None:
    """Return the settings in ``folder`` or the nearest parent that has any."""
    # Called for every file and every parent: a Path for each would be slow.
    root = str(folder)
    while True:
        try:
            status = os.lstat(f"{root}/{SETTINGS_FILE}")
        except OSError:  # also for folders without permission
            status = None
        if status is not None:
            return _read_file(root or "/", status.st_mtime_ns, status.st_size)
        if not root.strip("/"):
            return None
        root = root.rpartition("/")[0]


def read_settings(written: SettingsSource) -> tuple[Settings, list[Diagnostic]]:
    """Return the valid settings and the diagnostics."""
    tree = written.tree
    if tree is None:
        return Settings(written.source), []
    diagnostics = check_schema(tree, _SCHEMA)
    settings = Settings(
        written.source,
        nodes=_folders(tree, "nodes", written.root, diagnostics),
        interfaces=_folders(tree, "interfaces", written.root, diagnostics),
        strict=flag(tree.get("strict"), default=False),
        select=_limited(texts(tree.get("select")), "select", diagnostics),
        ignore=_limited(texts(tree.get("ignore")), "ignore", diagnostics),
        severity=_limited(tuple(_severities(tree)), "severity", diagnostics),
    )
    return settings, diagnostics


def _limited(
    given: tuple[_Item, ...], setting: str, diagnostics: list[Diagnostic]
) -> tuple[_Item, ...]:
    """Return the first entries of a setting about rules, and report if there are more."""
    if len(given) > _MAX_RULES:
        item = given[_MAX_RULES]
        name = item[0] if isinstance(item, tuple) else item
        message = f"'{setting}' has more than {_MAX_RULES} entries; there are fewer rules"
        diagnostics.append(Diagnostic(BAD_SETTING, message, name.span))
    return given[:_MAX_RULES]


def is_inside(path: Path, root: Path) -> bool:
    """Return whether ``path`` is in ``root`` after resolving symbolic links."""
    try:
        # Unlike Path.resolve, it handles symbolic link loops the same way on every Python.
        return Path(os.path.realpath(path)).is_relative_to(root)
    except (OSError, ValueError):  # not a valid path
        return False


@lru_cache(maxsize=32)
def _read_file(folder: str, _time_ns: int, _size: int) -> SettingsSource:
    """Read the settings in ``folder``, again only if the time or size of the file has changed."""
    root = Path(folder)
    path = root / SETTINGS_FILE
    name = shown_path(path)
    if not is_inside(path, root):
        source = SourceFile(name)
        message = "this is a symbolic link out of the project"
        problem = Diagnostic(UNREADABLE_FILE, message, Span(source, 1, 1))
        return SettingsSource(root, source, None, (problem,))
    tree, source, diagnostics = read_document(path, name)
    if [diagnostic.rule for diagnostic in diagnostics] == [YAML_SYNTAX] and _is_empty(source):
        return SettingsSource(root, source, Mapping((), Span(source, 1, 1)), ())
    return SettingsSource(root, source, tree, tuple(diagnostics))


def _is_empty(source: SourceFile) -> bool:
    return all(not line.strip() or line.lstrip().startswith("#") for line in source.lines)


def _folders(
    tree: Mapping, name: str, root: Path, diagnostics: list[Diagnostic]
) -> tuple[Path, ...] | None:
    if not isinstance(tree.get(name), Sequence):
        return None
    found = []
    for text in texts(tree.get(name)):
        folder = root / text.value
        problem = _problem(folder, root)
        if problem is None:
            found.append(folder.resolve())
            continue
        # Git keeps no empty folders: a project without node types is complete without this one.
        is_missing = problem == _MISSING
        diagnostics.append(
            Diagnostic(
                replace(BAD_SETTING, severity=Severity.WARNING) if is_missing else BAD_SETTING,
                f"'{shown(text.value)}' {problem}",
                text.span,
                hint=_similar(folder)
                if is_missing
                else "use a folder below the folder of this file",
                subjects=() if is_missing else (("folder", name),),
            )
        )
    return tuple(found)


def _similar(folder: Path) -> str | None:
    try:
        return suggestion(folder.name, [x.name for x in folder.parent.iterdir() if x.is_dir()])
    except OSError:
        return None


def _problem(folder: Path, root: Path) -> str | None:
    try:
        if not folder.resolve().is_relative_to(root):
            return "is outside the project"
        if folder.is_dir():
            return None
        return "is not a folder" if folder.exists() else _MISSING
    except (OSError, RuntimeError, ValueError):  # too long, a loop of links or not a valid path
        return "is not a folder"


def _severities(tree: Mapping) -> Iterator[tuple[Located[str], Severity]]:
    known = {severity.value: severity for severity in Severity}
    for entry in entries(tree.get("severity")):
        severity = known.get(plain_text(entry.value))
        if severity is not None:
            yield key(entry), severity


def apply_rule_settings(diagnostics: Iterable[Diagnostic], settings: Settings) -> list[Diagnostic]:
    """Return the selected diagnostics with the severities that the project sets.

    Errors cannot be ignored or downgraded: they prevent a system from running.
    """
    if settings.source is None:
        return list(diagnostics)
    kept = (diagnostic for diagnostic in diagnostics if _is_selected(diagnostic.rule, settings))
    return [_with_severity(diagnostic, settings) for diagnostic in kept]


def check_rule_settings(settings: Settings, rules: Collection[Rule]) -> Iterator[Diagnostic]:
    """Yield diagnostics for wrong names of rules in ``settings``."""
    for text in (*settings.select, *settings.ignore):
        if not any(rule.matches(text.value) for rule in rules):
            yield _unknown(text, rules)
    for text in settings.ignore:
        if any(_is_exactly(rule, text) and rule.severity is Severity.ERROR for rule in rules):
            yield _about_error(text, "ignored")
    for text, severity in settings.severity:
        rule = next((rule for rule in rules if _is_exactly(rule, text)), None)
        if rule is None:
            yield _unknown(text, rules)
        elif rule.severity is Severity.ERROR and severity is not Severity.ERROR:
            yield _about_error(text, f"made {_WORDS[severity]}")


def _is_selected(rule: Rule, settings: Settings) -> bool:
    if rule.severity is Severity.ERROR:
        return True
    if any(rule.matches(text.value) for text in settings.ignore):
        return False
    return not settings.select or any(rule.matches(text.value) for text in settings.select)


def _with_severity(diagnostic: Diagnostic, settings: Settings) -> Diagnostic:
    rule = diagnostic.rule
    if rule.severity is Severity.ERROR:
        return diagnostic
    for text, severity in settings.severity:
        if _is_exactly(rule, text) and severity is not rule.severity:
            return replace(diagnostic, rule=replace(rule, severity=severity))
    return diagnostic


def _is_exactly(rule: Rule, text: Located[str]) -> bool:
    return text.value in {rule.code, rule.name}


def _unknown(text: Located[str], rules: Iterable[Rule]) -> Diagnostic:
    names = [name for rule in rules for name in (rule.code, rule.name)]
    message = f"there is no rule '{shown(text.value)}'"
    close = suggestion(text.value, names, limit=0)
    hint = close or "'compose validate --explain RC' lists the rules"
    return Diagnostic(BAD_SETTING, message, text.span, hint=hint)


def _about_error(text: Located[str], what: str) -> Diagnostic:
    message = f"'{text}' is an error, which cannot be {what}"
    return Diagnostic(BAD_SETTING, message, text.span, hint="fix the reported problem")
