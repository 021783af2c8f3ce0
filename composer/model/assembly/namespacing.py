"""Place an included system below a namespace, and prefix the names of its nodes.

Settings of the file for all of its nodes (namespace, lifecycle, introspection, use_sim_time) move
into each node, so that they do not affect the including system.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree
from composer.model import USE_SIM_TIME
from composer.model.assembly.merging import merge_maps

_CHANNEL_KEYS = frozenset({"topic", "service", "action"})
_ENDPOINT_KEYS = frozenset({"from", "to", "server", "clients"})
#: Keys that a file has for all nodes, and a node for itself.
_NODE_DEFAULTS = ("lifecycle", "introspection")
#: Keys of ``lifecycle`` that apply to the whole system, not to each node.
_NOT_INHERITED = frozenset({"implied_dependencies"})

_Change = Callable[[Tree], Tree]


@dataclass(frozen=True, slots=True)
class Placement:
    """The prefix for node names and the namespace that an include gives to a file."""

    prefix: str = ""
    namespace: Located[str] | None = None


def add_namespace(tree: Mapping, placement: Placement, includer: Path, folder: Path) -> Mapping:
    """Return a system from ``folder`` as a part of the system in the folder ``includer``."""
    names = _NameChanges(
        placement.prefix, _join_namespaces(placement.namespace, tree.get("namespace"))
    )
    defaults = _defaults(tree)
    changes: dict[str, _Change] = {
        "nodes": lambda part: names.change_nodes(part, defaults),
        "connections": names.change_connections,
        "chains": names.change_chains,
        "processes": names.change_processes,
        "parameter_files": lambda part: _relative_to(includer, folder, part),
    }
    return Mapping(
        tuple(
            Entry(entry.key, changes[entry.name](entry.value)) if entry.name in changes else entry
            for entry in tree
        ),
        tree.span,
    )


def _join_namespaces(outer: Located[str] | None, inner: Tree | None) -> Located[str] | None:
    """Return the namespace ``inner`` below ``outer``; an absolute one is not changed."""
    if not isinstance(inner, Scalar) or not isinstance(inner.value, str):
        return outer
    if outer is None or inner.value.startswith("/") or _is_opaque(inner.value):
        return Located(inner.value, inner.span)
    return Located(f"{outer.value.rstrip('/')}/{inner.value}", inner.span)


def _relative_to(includer: Path, folder: Path, tree: Tree) -> Tree:
    """Return paths relative to ``folder`` as paths relative to ``includer``."""
    match tree:
        case Sequence():
            items = tuple(_relative_to(includer, folder, item) for item in tree.items)
            return Sequence(items, tree.span)
        case Scalar(value=str() as text) if includer != folder and not _is_opaque(text):
            path = os.path.relpath(folder / text, includer)
            return Scalar(path, tree.span, verbatim=False)
        case _:
            return tree


def _defaults(tree: Mapping) -> dict[str, Mapping]:
    """Return the settings of a file for all of its nodes, by their key in a node."""
    found = {}
    for name in _NODE_DEFAULTS:
        section = tree.get(name)
        entries = tuple(entry for entry in _entries(section) if entry.name not in _NOT_INHERITED)
        if section is not None and entries:
            found[name] = Mapping(entries, section.span)
    clock = tree.entry(USE_SIM_TIME)
    if clock is not None and isinstance(clock.value, Scalar):
        found["parameters"] = Mapping((clock,), clock.key.span)
    return found


def _entries(tree: Tree | None) -> tuple[Entry, ...]:
    return tree.entries if isinstance(tree, Mapping) else ()


@dataclass(frozen=True, slots=True)
class _NameChanges:
    prefix: str
    namespace: Located[str] | None

    def change_nodes(self, tree: Tree, defaults: dict[str, Mapping]) -> Tree:
        if not isinstance(tree, Mapping):
            return tree
        return Mapping(tuple(self._node(entry, defaults) for entry in tree), tree.span)

    def change_connections(self, tree: Tree) -> Tree:
        if not isinstance(tree, Sequence):
            return tree
        return Sequence(
            tuple(_changed(item, self._in_connection) for item in tree.items), tree.span
        )

    def change_chains(self, tree: Tree) -> Tree:
        if not isinstance(tree, Mapping):
            return tree

        def renamed(entry: Entry) -> Tree:
            return self._add_prefix(entry.value) if entry.name == "through" else entry.value

        chains = (
            Entry(self._prefixed_key(entry.key), _changed(entry.value, renamed)) for entry in tree
        )
        return Mapping(tuple(chains), tree.span)

    def change_processes(self, tree: Tree) -> Tree:
        def renamed(entry: Entry) -> Tree:
            return self._add_prefix(entry.value) if entry.name == "nodes" else entry.value

        return _changed(tree, lambda process: _changed(process.value, renamed))

    def _node(self, entry: Entry, defaults: dict[str, Mapping]) -> Entry:
        key = self._prefixed_key(entry.key)
        if not isinstance(entry.value, Mapping):
            return Entry(key, entry.value)
        tree = _changed_map(entry.value, self._in_node)
        added = [
            _with_defaults(tree.entry(name), name, defaults[name], key.span) for name in defaults
        ]
        added.append(self._namespace_entry(entry.value, key.span))
        changes = {change.name: change for change in added if change is not None}
        kept = tuple(changes.pop(inner.name, inner) for inner in tree)
        return Entry(key, Mapping((*kept, *changes.values()), tree.span))

    def _in_node(self, entry: Entry) -> Tree:
        if entry.name != "lifecycle":
            return entry.value
        return _changed(entry.value, self._in_lifecycle)

    def _in_lifecycle(self, entry: Entry) -> Tree:
        if entry.name != "depends_on":
            return entry.value
        if isinstance(entry.value, Mapping):
            entries = (Entry(self._prefixed_key(inner.key), inner.value) for inner in entry.value)
            return Mapping(tuple(entries), entry.value.span)
        return self._add_prefix(entry.value)

    def _in_connection(self, entry: Entry) -> Tree:
        if entry.name in _ENDPOINT_KEYS:
            return self._add_prefix(entry.value)
        if entry.name in _CHANNEL_KEYS and self.namespace is not None:
            return self._add_namespace(entry.value, self.namespace)
        return entry.value

    def _add_namespace(self, tree: Tree, namespace: Located[str]) -> Tree:
        if not isinstance(tree, Scalar) or not isinstance(tree.value, str):
            return tree
        if not tree.value or tree.value[0] in "/~" or _is_opaque(tree.value):
            return tree
        name = f"{namespace.value.rstrip('/')}/{tree.value}"
        return Scalar(name, tree.span, verbatim=False)

    def _namespace_entry(self, node: Mapping, span: Span) -> Entry | None:
        if self.namespace is None:
            return None
        own = node.entry("namespace")
        below = _join_namespaces(self.namespace, own.value if own is not None else None)
        if below is None or (own is not None and not isinstance(own.value, Scalar)):
            return None
        key = own.key if own is not None else Scalar("namespace", span, verbatim=False)
        return Entry(key, Scalar(below.value, below.span, verbatim=False))

    def _add_prefix(self, tree: Tree) -> Tree:
        """Return ``node`` or ``node.port``, or a list of them, with the prefix."""
        match tree:
            case Sequence():
                return Sequence(tuple(map(self._add_prefix, tree.items)), tree.span)
            case Scalar(value=str() as text) if self.prefix and not _is_opaque(text):
                return Scalar(f"{self.prefix}{text}", tree.span, verbatim=False)
            case _:
                return tree

    def _prefixed_key(self, key: Scalar) -> Scalar:
        renamed = self._add_prefix(key)
        return renamed if isinstance(renamed, Scalar) else key


def _with_defaults(own: Entry | None, name: str, defaults: Mapping, span: Span) -> Entry | None:
    """Return the node's entry ``name`` merged over the defaults of its file."""
    if own is None:
        return Entry(Scalar(name, span, verbatim=False), defaults)
    if not isinstance(own.value, Mapping):
        return None
    return Entry(own.key, merge_maps(defaults, own.value))


def _changed(tree: Tree, change: Callable[[Entry], Tree]) -> Tree:
    return _changed_map(tree, change) if isinstance(tree, Mapping) else tree


def _changed_map(tree: Mapping, change: Callable[[Entry], Tree]) -> Mapping:
    return Mapping(tuple(Entry(entry.key, change(entry)) for entry in tree), tree.span)


def _is_opaque(text: str) -> bool:
    return "${" in text
