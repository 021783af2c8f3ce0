"""Wildcards such as ``camera_*`` in the node names of connections and dependencies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree
from composer.model.assembly.limits import IncludeLimits
from composer.model.names import matches_wildcard

WILDCARD = "*"
_ENDPOINT_KEYS = frozenset({"from", "to", "server", "clients"})


@dataclass(slots=True)
class Wildcards:
    """Replaces patterns, in which ``*`` matches any text, with the names of nodes."""

    names: tuple[str, ...]
    limits: IncludeLimits
    _found: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def in_connections(self, tree: Tree) -> Tree:
        """Return ``connections`` with the endpoints of all nodes that match patterns."""
        if not isinstance(tree, Sequence):
            return tree
        return Sequence(tuple(self._in_connection(item) for item in tree.items), tree.span)

    def in_processes(self, tree: Tree) -> Tree:
        """Return ``processes`` with all nodes that match patterns."""
        return _changed(tree, lambda process: _changed(process.value, self._in_process))

    def _in_process(self, entry: Entry) -> Tree:
        tree = entry.value
        if entry.name == "nodes" and isinstance(tree, Sequence) and _has_wildcard(tree.items):
            return Sequence(tuple(self._names(tree.items)), tree.span)
        return tree

    def in_nodes(self, tree: Tree) -> Tree:
        """Return ``nodes`` with dependencies on all nodes that match patterns."""
        return _changed(tree, lambda node: self._in_node(node.value))

    def _in_node(self, tree: Tree) -> Tree:
        return _changed(
            tree,
            lambda entry: (
                _changed(entry.value, self._in_lifecycle)
                if entry.name == "lifecycle"
                else entry.value
            ),
        )

    def _in_lifecycle(self, entry: Entry) -> Tree:
        tree = entry.value
        if entry.name != "depends_on":
            return tree
        match tree:
            case Sequence() if _has_wildcard(tree.items):
                return Sequence(tuple(self._names(tree.items)), tree.span)
            case Mapping() if _has_wildcard(entry.key for entry in tree):
                named = {
                    str(key.value): Entry(key, entry.value)
                    for entry in tree
                    for key in self._names([entry.key])
                    if isinstance(key, Scalar)
                }
                return Mapping(tuple(named.values()), tree.span)
            case _:
                return tree

    def _in_connection(self, tree: Tree) -> Tree:
        return _changed(
            tree,
            lambda entry: (
                self._endpoints(entry.value) if entry.name in _ENDPOINT_KEYS else entry.value
            ),
        )

    def _endpoints(self, tree: Tree) -> Tree:
        items = tree.items if isinstance(tree, Sequence) else (tree,)
        if not _has_wildcard(items):
            return tree
        return Sequence(tuple(self._ports(items)), tree.span)

    def _ports(self, items: Iterable[Tree]) -> Iterator[Tree]:
        for item in items:
            text = _text(item)
            node, dot, port = text.rpartition(".")
            names = self._matching(node, item.span)
            yield from (Scalar(f"{name}{dot}{port}", item.span, False) for name in names)
            if not names:  # a rule reports the unknown node
                yield item

    def _names(self, items: Iterable[Tree]) -> Iterator[Tree]:
        for item in items:
            text = _text(item)
            names = self._matching(text, item.span)
            yield from (Scalar(name, item.span, False) for name in names)
            if not names:
                yield item

    def _matching(self, pattern: str, span: Span) -> tuple[str, ...]:
        if WILDCARD not in pattern:
            return ()
        if pattern not in self._found:
            self.limits.compare(len(self.names) * (1 + len(pattern) // 64), span)
            self._found[pattern] = tuple(
                name for name in self.names if matches_wildcard(pattern, name)
            )
        self.limits.match(len(self._found[pattern]), span)
        return self._found[pattern]


def _changed(tree: Tree, change: Callable[[Entry], Tree]) -> Tree:
    """Return a map with changed values; the same object if none changes."""
    if not isinstance(tree, Mapping):
        return tree
    entries = [(entry, change(entry)) for entry in tree]
    if all(entry.value is value for entry, value in entries):
        return tree
    return Mapping(tuple(Entry(entry.key, value) for entry, value in entries), tree.span)


def _has_wildcard(items: Iterable[Tree]) -> bool:
    return any(WILDCARD in _text(item) for item in items)


def _text(tree: Tree) -> str:
    return tree.value if isinstance(tree, Scalar) and isinstance(tree.value, str) else ""
