"""The canonical form of a merged file, as ``compose config`` shows it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from composer.language.schema import NODE, SYSTEM, schema
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree

T = TypeVar("T")

_ARGUMENTS = "arguments"
_NODES = "nodes"


def canonical(tree: Mapping) -> Mapping:
    """Return an assembled tree as one equivalent file, with its keys in the usual order.

    The arguments of a system have been expanded, so the section is left out. Any text that still
    looks like a variable is escaped.
    """
    if tree.entry(SYSTEM) is None:
        return _sort_keys(tree, schema(NODE)["properties"])
    system = schema(SYSTEM)
    definitions = system["definitions"]
    node_keys = {
        **definitions["node_with_type"]["properties"],
        **definitions["inline_node"]["properties"],
    }
    entries = [
        Entry(
            entry.key,
            _nodes(entry.value, node_keys) if entry.name == _NODES else _escape(entry.value),
        )
        for entry in tree
        if entry.name != _ARGUMENTS
    ]
    return _sort_keys(Mapping(tuple(entries), tree.span), system["properties"])


def _nodes(tree: Tree, keys: Iterable[str]) -> Tree:
    if not isinstance(tree, Mapping):
        return tree
    entries = (
        Entry(_escape_text(entry.key), _sort_keys(_escape(entry.value), keys)) for entry in tree
    )
    return Mapping(tuple(entries), tree.span)


def _sort_keys(tree: T, keys: Iterable[str]) -> T | Mapping:
    """Return a map with its keys in the order of ``keys``, and any other value unchanged."""
    if not isinstance(tree, Mapping):
        return tree
    positions = {name: position for position, name in enumerate(keys)}
    entries = sorted(tree, key=lambda entry: positions.get(entry.name, len(positions)))
    return Mapping(tuple(entries), tree.span)


def _escape(tree: Tree) -> Tree:
    match tree:
        case Mapping():
            entries = tuple(Entry(entry.key, _escape(entry.value)) for entry in tree)
            return Mapping(entries, tree.span)
        case Sequence():
            return Sequence(tuple(map(_escape, tree.items)), tree.span)
        case Scalar():
            return _escape_text(tree)


def _escape_text(scalar: Scalar) -> Scalar:
    if not isinstance(scalar.value, str) or "${" not in scalar.value:
        return scalar
    return Scalar(scalar.value.replace("${", "$${"), scalar.span, verbatim=False)
