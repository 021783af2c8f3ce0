"""Entries of ``include``, and the files that they name."""

from __future__ import annotations

import os
import re
from dataclasses import field
from pathlib import Path

from composer.base.diagnostics import Diagnostic, shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, SourceFile, Span
from composer.language.document import read_document, similar_file
from composer.language.rules import TOO_LARGE, UNREADABLE_FILE
from composer.language.schema.kinds import SYSTEM, check_kind
from composer.language.tree import Entry, Mapping, Tree
from composer.language.tree_values import entries, is_opaque, text
from composer.model.assembly.limits import INVALID_INCLUDE, SystemLimits
from composer.model.assembly.namespacing import Placement
from composer.model.names import namespace_problem
from composer.project import OUTSIDE_HINT, Project

_PREFIX = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, slots=True)
class Include:
    """An entry of ``include``. ``file`` is relative to the including file."""

    file: Located[str]
    placement: Placement
    arguments: dict[str, Entry]
    overrides: Mapping | None
    naming: Span  # of what decides the names of its nodes: its prefix, or the file


@dataclass(frozen=True, slots=True)
class SystemFile:
    """A system file that was read; ``path`` has its symbolic links resolved."""

    path: Path
    source: SourceFile
    tree: Mapping


def read_include(tree: Tree, diagnostics: list[Diagnostic]) -> Include | None:
    """Return an entry, without the parts that have the wrong type; None without a file."""
    entry = tree if isinstance(tree, Mapping) else None
    file = text(entry.get("file") if entry is not None else tree)
    if file is None or is_opaque(file.value):
        return None
    if entry is None:
        return Include(file, Placement(), {}, None, file.span)
    arguments, overrides = entry.get("arguments"), entry.get("overrides")
    before = len(diagnostics)
    namespace = _namespace(entry, diagnostics)
    # the value of a loop may be in both; it is reported once
    written, prefix = text(entry.get("namespace")), text(entry.get("prefix"))
    is_same = written is not None and prefix is not None and written.value in prefix.value
    found = [] if is_same and len(diagnostics) > before else diagnostics
    return Include(
        file,
        Placement(_prefix(entry, found), namespace),
        {item.name: item for item in entries(arguments)},
        overrides if isinstance(overrides, Mapping) else None,
        file.span if (given := entry.get("prefix")) is None else given.span,
    )


@dataclass(slots=True)
class IncludeReader:
    """Reads the files of one system, each once."""

    project: Project
    limits: SystemLimits
    diagnostics: list[Diagnostic]
    _files: dict[Path, SystemFile | None] = field(default_factory=dict)

    def read(self, name: Located[str], folder: Path, includer: SourceFile) -> SystemFile | None:
        """Return the file ``name`` in ``folder``; None if it cannot be included.

        The reason is reported where it is included. Raises Stopped.
        """
        path = self._path_of(name, folder)
        if path is None:
            return None
        if path not in self._files:
            shown_path = os.path.normpath(Path(includer.path).parent / name.value)
            self._files[path] = self._read(path, name, shown_path)
        return self._files[path]

    def _path_of(self, name: Located[str], folder: Path) -> Path | None:
        target = folder / name.value
        try:
            if Path(name.value).is_absolute():
                self._refuse(
                    name, "is an absolute path", "use a path relative to this file: 'a.yaml'"
                )
            elif not self.project.holds(target):
                self._refuse(name, "is outside the project", OUTSIDE_HINT)
            elif not target.exists():
                self._refuse(
                    name, "does not exist", similar_file(target, name.value, ".yaml", ".yml")
                )
            else:
                return target.resolve()
        except (OSError, RuntimeError, ValueError):
            self._refuse(name, "cannot be read", None)
        return None

    def _read(self, path: Path, name: Located[str], shown_path: str) -> SystemFile | None:
        tree, source, found = read_document(path, shown_path)
        self.limits.count("characters", len(source.text), name.span)
        for diagnostic in found:
            if not source.text and diagnostic.rule in (UNREADABLE_FILE, TOO_LARGE):
                self._refuse(name, f"cannot be included: {diagnostic.message}", diagnostic.hint)
            else:
                self.diagnostics.append(diagnostic)
        if tree is None:
            return None
        wrong_kind = check_kind(tree, source, (SYSTEM,))
        if wrong_kind is not None:
            self._refuse(name, "is not a system", wrong_kind.hint)
            return None
        return SystemFile(path, source, tree)

    def _refuse(self, name: Located[str], why: str, hint: str | None) -> None:
        message = f"'{shown(name.value)}' {why}"
        self.diagnostics.append(Diagnostic(INVALID_INCLUDE, message, name.span, hint=hint))


def _prefix(entry: Mapping, diagnostics: list[Diagnostic]) -> str:
    prefix = text(entry.get("prefix"))
    if prefix is None or not prefix.value or is_opaque(prefix.value):
        return ""
    if _PREFIX.fullmatch(prefix.value):
        return prefix.value
    message = f"a node name cannot begin with '{shown(prefix.value)}'"
    hint = "use letters, digits and '_', starting with a letter: 'left_'"
    diagnostics.append(Diagnostic(INVALID_INCLUDE, message, prefix.span, hint=hint))
    return ""


def _namespace(entry: Mapping, diagnostics: list[Diagnostic]) -> Located[str] | None:
    namespace = text(entry.get("namespace"))
    if namespace is None or is_opaque(namespace.value):
        return namespace  # names with an unknown variable are not checked
    absolute = namespace.value if namespace.value.startswith("/") else f"/{namespace.value}"
    problem = namespace_problem(absolute)
    if problem is None:
        return namespace
    message = f"namespace '{shown(namespace.value)}' {problem}"
    diagnostics.append(Diagnostic(INVALID_INCLUDE, message, namespace.span))
    return None
