"""Walks over syntax trees."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

#: Nodes without a location and without code: ``ast.Load``, ``ast.Add`` and the like.
_MARKS = (ast.expr_context, ast.operator, ast.boolop, ast.unaryop, ast.cmpop)


def children(node: ast.AST) -> list[ast.AST]:
    """Return the nodes directly below ``node``, in source order, without contexts and operators."""
    found: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(value, list):
            found += [item for item in value if isinstance(item, ast.AST)]
        elif isinstance(value, ast.AST) and not isinstance(value, _MARKS):
            found.append(value)
    return found


def walk(body: Sequence[ast.AST], *, closed: tuple[type[ast.AST], ...] = ()) -> Iterator[ast.AST]:
    """Yield the nodes of ``body`` in source order, without those inside nodes of a closed class."""
    pending = list(body[::-1])
    while pending:
        node = pending.pop()
        yield node
        if not isinstance(node, closed):
            pending += children(node)[::-1]
