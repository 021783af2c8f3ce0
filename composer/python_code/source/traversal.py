"""Walks over syntax trees."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cache

#: Fields with plain values, and those with what has no location: contexts and operators.
_OTHER_FIELDS = frozenset(
    {"arg", "asname", "attr", "conversion", "ctx", "id", "is_async", "kind", "level", "module"}
    | {"op", "ops", "rest", "simple", "type_comment"}
)

#: The attribute of a node with the nodes below it.
_KEPT = "_children"


def children(node: ast.AST) -> Sequence[ast.AST]:
    """Return the nodes directly below ``node``, in source order, without contexts and operators.

    The tree must not change afterwards: they are kept, because checks visit each node many times.
    """
    known: Sequence[ast.AST] | None = node.__dict__.get(_KEPT)
    if known is None:
        known = node.__dict__[_KEPT] = _children(node)
    return known


def _children(node: ast.AST) -> Sequence[ast.AST]:
    found: list[ast.AST] = []
    for name in _fields(node.__class__):  # type: ignore[arg-type]  # a class is hashable
        value = getattr(node, name, None)
        if isinstance(value, list):
            found += [item for item in value if isinstance(item, ast.AST)]
        elif isinstance(value, ast.AST):
            found.append(value)
    return found


@cache
def _fields(kind: type[ast.AST]) -> tuple[str, ...]:
    return tuple(name for name in kind._fields if name not in _OTHER_FIELDS)


def walk(body: Sequence[ast.AST], *, closed: tuple[type[ast.AST], ...] = ()) -> Iterator[ast.AST]:
    """Yield the nodes of ``body`` in source order, without those inside nodes of a closed class."""
    pending = list(body[::-1])
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, closed):
            pending += children(node)[::-1]
