"""References to nodes in a system: prefixes, wildcards such as ``camera_*``, absent nodes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import field
from functools import partial
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.tree import (
    Entry,
    LeftOut,
    Mapping,
    Scalar,
    Sequence,
    Tree,
    changed_at,
    entries,
    items,
    mapping,
    plain,
    plain_text,
)
from composer.model.assembly.limits import SystemLimits
from composer.model.names import matches_wildcard

WILDCARD = "*"
#: Where a system names nodes, and where it names ports of nodes.
_NODES = (
    ("nodes", "*", "lifecycle", "depends_on"),
    ("processes", "*", "nodes"),
)
_CONTAINER = ("nodes", "*", "container")
_PORTS = tuple(("connections", "*", end) for end in ("from", "to", "server", "clients"))
_CHAINS = ("chains", "*", "through")

#: Returns the references in place of one; the same object if it does not change.
Change: TypeAlias = Callable[[Scalar], tuple[Scalar, ...]]


def add_prefix(tree: Mapping, prefix: str) -> Mapping:
    """Return a system with ``prefix`` before the names of its nodes, where it refers to them."""

    def prefixed(name: Scalar) -> tuple[Scalar, ...]:
        return (with_prefix(name, prefix),)

    for path in (*_NODES, _CONTAINER, *_PORTS, _CHAINS):
        tree = changed_at(tree, path, partial(_changed, change=prefixed))
    return tree


def with_prefix(name: Scalar, prefix: str) -> Scalar:
    """Return a name with a prefix, unless it has an unknown variable."""
    if not isinstance(name.value, str) or "${" in name.value or not prefix:
        return name
    return Scalar(f"{prefix}{name.value}", name.span, verbatim=False)


def expand_references(tree: Mapping, left_out: Iterable[LeftOut], limits: SystemLimits) -> Mapping:
    """Return a system with the names of nodes in place of patterns. Raises Stopped.

    Nodes that are left out go out of lists and of patterns. At the end of a connection, one of them
    stays if no other node is there: the connection would end nowhere. So does a container. Chains
    have no patterns, because their ports have an order.
    """
    names = [entry.name for entry in entries(tree.get("nodes"))]
    absent = [item.name for item in left_out if item.section == "nodes"]
    wildcards = _Wildcards(dict.fromkeys(names), dict.fromkeys(absent), limits)
    for path in _NODES:
        tree = changed_at(tree, path, wildcards.nodes)
    for path in _PORTS:
        tree = changed_at(tree, path, wildcards.end)
    return changed_at(tree, _CONTAINER, wildcards.container)


def without_empty_processes(tree: Mapping, left_out: Iterable[LeftOut]) -> Mapping:
    """Return a system without the processes that have no nodes, if conditions leave nodes out."""
    if not any(item.section == "nodes" for item in left_out):
        return tree
    used = {plain_text(mapping(entry).get("process")) for entry in entries(tree.get("nodes"))}

    def kept(section: Tree) -> Tree:
        if not isinstance(section, Mapping):
            return section
        inner = tuple(
            entry
            for entry in section
            if entry.name in used
            or not isinstance(entry.value, Mapping)
            or items(entry.value.get("nodes"))
        )
        return Mapping(inner, section.span)

    return changed_at(tree, ("processes",), kept)


def without_left_out(overrides: Mapping, left_out: Iterable[LeftOut]) -> Mapping:
    """Return the overrides of an include without entries that are left out of its file."""
    names = {(item.section, item.name) for item in left_out}

    def kept(section: Entry) -> Tree:
        if not isinstance(section.value, Mapping):
            return section.value
        inner = tuple(item for item in section.value if (section.name, item.name) not in names)
        return Mapping(inner, section.value.span)

    return Mapping(tuple(Entry(item.key, kept(item)) for item in overrides), overrides.span)


def _changed(tree: Tree, change: Change) -> Tree:
    """Return a reference, a list of references, or a map with references as keys, changed."""
    match tree:
        case Scalar():
            changed = change(tree)
            return changed[0] if len(changed) == 1 else Sequence(changed, tree.span)
        case Sequence():
            return Sequence(tuple(_changed_items(tree, change)), tree.span)
        case Mapping():
            named = {
                str(key.value): Entry(key, entry.value)
                for entry in tree
                for key in change(entry.key)
            }
            return Mapping(tuple(named.values()), tree.span)


def _changed_items(tree: Sequence, change: Change) -> Iterator[Tree]:
    for item in tree.items:
        yield from change(item) if isinstance(item, Scalar) else (item,)


@dataclass(slots=True)
class _Wildcards:
    """Replaces patterns, in which ``*`` matches any text, with the names of nodes.

    Nothing replaces a name or a pattern of nodes that are left out, ``absent``. A pattern without
    matches stays: a rule reports the unknown node.
    """

    names: Collection[str]
    absent: Collection[str]
    limits: SystemLimits
    _found: dict[str, tuple[str, ...]] = field(default_factory=dict)
    _absent_patterns: list[str] = field(init=False)

    def __post_init__(self) -> None:
        self._absent_patterns = [name for name in self.absent if WILDCARD in name]

    def nodes(self, tree: Tree) -> Tree:
        return _changed(tree, self._names)

    def container(self, tree: Tree) -> Tree:
        """Return the container of a component, as it is if it is left out."""
        return self.nodes(tree) if not isinstance(tree, Scalar) or self._names(tree) else tree

    def end(self, tree: Tree) -> Tree:
        """Return the end of a connection; as it is if there are names and none stays."""
        changed = _changed(tree, self._ports)
        is_empty = isinstance(changed, Sequence) and not changed.items
        has_name = any(WILDCARD not in str(plain(item)) for item in (items(tree) or (tree,)))
        return tree if is_empty and has_name else changed

    def _names(self, reference: Scalar) -> tuple[Scalar, ...]:
        return self._matching(reference, str(reference.value), "")

    def _ports(self, reference: Scalar) -> tuple[Scalar, ...]:
        node, dot, port = str(reference.value).rpartition(".")
        return self._matching(reference, node, f"{dot}{port}")

    def _matching(self, reference: Scalar, pattern: str, port: str) -> tuple[Scalar, ...]:
        if WILDCARD not in pattern:
            is_absent = pattern not in self.names and self._is_absent(pattern, reference.span)
            return () if is_absent else (reference,)
        span = reference.span
        if pattern not in self._found:
            self._count_comparisons(pattern, self.names, span)
            self._found[pattern] = tuple(
                name for name in self.names if matches_wildcard(pattern, name)
            )
        names = self._found[pattern]
        self.limits.count("matches", len(names), span)
        if not names and self._is_absent(pattern, span):
            return ()
        return tuple(Scalar(f"{name}{port}", span, False) for name in names) or (reference,)

    def _is_absent(self, pattern: str, span: Span) -> bool:
        """Return whether a name or a pattern is one of a node that is left out."""
        if pattern in self.absent:
            return True
        others = self.absent if WILDCARD in pattern else self._absent_patterns
        self._count_comparisons(pattern, others, span)
        return any(
            matches_wildcard(pattern, name) or matches_wildcard(name, pattern) for name in others
        )

    def _count_comparisons(self, pattern: str, names: Collection[str], span: Span) -> None:
        """Count what takes time. Raises Stopped."""
        self.limits.count("comparisons", len(names) * (1 + len(pattern) // 64), span)
