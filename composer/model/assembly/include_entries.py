"""Included systems: their files and arguments, their names below a prefix and a namespace.

Settings of the file for all of its nodes (namespace, lifecycle, introspection, use_sim_time) move
into each node, so that they do not affect the including system.
"""

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
from composer.language.schema import SYSTEM, check_kind
from composer.language.tree import (
    Entry,
    Mapping,
    Scalar,
    Sequence,
    Tree,
    changed_at,
    entries,
    is_opaque,
    text,
)
from composer.model import USE_SIM_TIME
from composer.model.assembly.limits import INVALID_INCLUDE, SystemLimits
from composer.model.assembly.merging import merge_maps
from composer.model.assembly.references import add_prefix, with_prefix
from composer.model.names import namespace_problem
from composer.project import OUTSIDE_HINT, Project

_PREFIX = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
#: Keys that a file has for all nodes, and a node for itself.
_NODE_DEFAULTS = ("lifecycle", "introspection")
#: Sections whose entries get the prefix.
PREFIXED = ("nodes", "chains")
#: Keys of ``lifecycle`` that apply to the whole system, not to each node.
_NOT_INHERITED = frozenset({"implied_dependencies"})


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


@dataclass(frozen=True, slots=True)
class Placement:
    """The prefix for node names and the namespace that an include gives to a file."""

    prefix: str = ""
    namespace: Located[str] | None = None


def add_namespace(tree: Mapping, placement: Placement, includer: Path, folder: Path) -> Mapping:
    """Return a system from ``folder`` as a part of the system in the folder ``includer``."""
    namespace = _join_namespaces(placement.namespace, tree.get("namespace"))
    defaults = _defaults(tree)
    prefix = placement.prefix

    def prefixed(section: Tree) -> Tree:
        named = (Entry(with_prefix(item.key, prefix), item.value) for item in entries(section))
        return Mapping(tuple(named), section.span) if isinstance(section, Mapping) else section

    def placed(nodes: Tree) -> Tree:
        made = (_placed(entry, namespace, defaults) for entry in entries(nodes))
        return Mapping(tuple(made), nodes.span) if isinstance(nodes, Mapping) else nodes

    tree = add_prefix(tree, prefix) if prefix else tree
    for section in PREFIXED:
        tree = changed_at(tree, (section,), prefixed)
    tree = changed_at(tree, ("nodes",), placed)
    if namespace is not None:
        for kind in ("topic", "service", "action"):
            path = ("connections", "*", kind)
            tree = changed_at(tree, path, lambda name: _below(namespace, name))
    return changed_at(
        tree, ("parameter_files",), lambda files: _relative_to(includer, folder, files)
    )


def _join_namespaces(outer: Located[str] | None, inner: Tree | None) -> Located[str] | None:
    """Return the namespace ``inner`` below ``outer``; an absolute one is not changed."""
    if not isinstance(inner, Scalar) or not isinstance(inner.value, str):
        return outer
    if outer is None or inner.value.startswith("/") or is_opaque(inner.value):
        return Located(inner.value, inner.span)
    return Located(f"{outer.value.rstrip('/')}/{inner.value}", inner.span)


def _below(namespace: Located[str], name: Tree) -> Tree:
    """Return the relative name of a connection below ``namespace``."""
    match name:
        case Scalar(value=str() as text) if text and text[0] not in "/~" and not is_opaque(text):
            return Scalar(f"{namespace.value.rstrip('/')}/{text}", name.span, verbatim=False)
        case _:
            return name


def _relative_to(includer: Path, folder: Path, tree: Tree) -> Tree:
    """Return paths relative to ``folder`` as paths relative to ``includer``."""
    match tree:
        case Sequence():
            items = tuple(_relative_to(includer, folder, item) for item in tree.items)
            return Sequence(items, tree.span)
        case Scalar(value=str() as text) if includer != folder and not is_opaque(text):
            path = os.path.relpath(folder / text, includer)
            return Scalar(path, tree.span, verbatim=False)
        case _:
            return tree


def _defaults(tree: Mapping) -> dict[str, Mapping]:
    """Return the settings of a file for all of its nodes, by their key in a node."""
    found = {}
    for name in _NODE_DEFAULTS:
        section = tree.get(name)
        given = tuple(entry for entry in entries(section) if entry.name not in _NOT_INHERITED)
        if section is not None and given:
            found[name] = Mapping(given, section.span)
    clock = tree.entry(USE_SIM_TIME)
    if clock is not None and isinstance(clock.value, Scalar):
        found["parameters"] = Mapping((clock,), clock.key.span)
    return found


def _placed(node: Entry, namespace: Located[str] | None, defaults: dict[str, Mapping]) -> Entry:
    """Return a node with the defaults of its file, below ``namespace``."""
    tree, span = node.value, node.key.span
    if not isinstance(tree, Mapping):
        return node
    added = [_with_defaults(tree.entry(name), name, defaults[name], span) for name in defaults]
    added.append(_namespace_entry(tree.entry("namespace"), namespace, span))
    changes = {change.name: change for change in added if change is not None}
    kept = tuple(changes.pop(inner.name, inner) for inner in tree)
    return Entry(node.key, Mapping((*kept, *changes.values()), tree.span))


def _namespace_entry(own: Entry | None, namespace: Located[str] | None, span: Span) -> Entry | None:
    if namespace is None or (own is not None and not isinstance(own.value, Scalar)):
        return None
    below = _join_namespaces(namespace, None if own is None else own.value) or namespace
    key = Scalar("namespace", span, verbatim=False) if own is None else own.key
    return Entry(key, Scalar(below.value, below.span, verbatim=False))


def _with_defaults(own: Entry | None, name: str, defaults: Mapping, span: Span) -> Entry | None:
    """Return the node's entry ``name`` merged over the defaults of its file."""
    if own is None:
        return Entry(Scalar(name, span, verbatim=False), defaults)
    if not isinstance(own.value, Mapping):
        return None
    return Entry(own.key, merge_maps(defaults, own.value))
