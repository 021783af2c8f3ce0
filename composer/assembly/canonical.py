"""A file as it is after everything was put into it: what ``compose config`` shows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from composer.schema import schema
from composer.schema.kinds import NODE, SYSTEM
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

T = TypeVar("T")

_VARIABLES = "variables"
_NODES = "nodes"


def canonical(tree: Mapping) -> Mapping:
    """Return an assembled tree as a file that says the same by itself, keys in the usual order.

    A system has its variables put in and needs them no more. What looks like one is a text, and
    is written as such.
    """
    if tree.entry(SYSTEM) is None:
        return _ordered(tree, schema(NODE)["properties"])
    whole = schema(SYSTEM)
    definitions = whole["definitions"]
    of_node = {
        **definitions["node_with_type"]["properties"],
        **definitions["inline_node"]["properties"],
    }
    entries = [
        Entry(
            entry.key,
            _nodes(entry.value, of_node) if entry.name == _NODES else _literal(entry.value),
        )
        for entry in tree
        if entry.name != _VARIABLES
    ]
    return _ordered(Mapping(tuple(entries), tree.span), whole["properties"])


def _nodes(tree: Tree, keys: Iterable[str]) -> Tree:
    if not isinstance(tree, Mapping):
        return tree
    entries = (
        Entry(_literal_text(entry.key), _ordered(_literal(entry.value), keys)) for entry in tree
    )
    return Mapping(tuple(entries), tree.span)


def _ordered(tree: T, keys: Iterable[str]) -> T | Mapping:
    """Return a map with its keys in the order of ``keys``; anything else as it is."""
    if not isinstance(tree, Mapping):
        return tree
    places = {name: place for place, name in enumerate(keys)}
    entries = sorted(tree, key=lambda entry: places.get(entry.name, len(places)))
    return Mapping(tuple(entries), tree.span)


def _literal(tree: Tree) -> Tree:
    match tree:
        case Mapping():
            entries = tuple(Entry(entry.key, _literal(entry.value)) for entry in tree)
            return Mapping(entries, tree.span)
        case Sequence():
            return Sequence(tuple(map(_literal, tree.items)), tree.span)
        case Scalar():
            return _literal_text(tree)


def _literal_text(scalar: Scalar) -> Scalar:
    if not isinstance(scalar.value, str) or "${" not in scalar.value:
        return scalar
    return Scalar(scalar.value.replace("${", "$${"), scalar.span, verbatim=False)
