"""On which conditions the calls of a function depend."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

_MAXIMUM_LENGTH = 60


def conditions_of_calls(function: ast.AST) -> dict[ast.Call, str]:
    """Return the innermost condition of each call that may not be made, as code.

    A call in an exception handler depends on an exception. What follows a branch that returns
    depends on its condition as well. A loop is not a condition.
    """
    return dict(_in_node(function, ""))


def negated(condition: str) -> str:
    """Return the opposite of a condition."""
    return condition.removeprefix("not ") if condition.startswith("not ") else f"not {condition}"


def _in_node(node: ast.AST, condition: str) -> Iterator[tuple[ast.Call, str]]:
    if isinstance(node, ast.Call) and condition:
        yield node, condition
    for nodes, inner in _parts(node, condition):
        yield from _in_body(nodes, inner)


def _parts(node: ast.AST, condition: str) -> Iterator[tuple[Sequence[ast.AST], str]]:
    """Yield the parts of a node, each with its condition."""
    match node:
        case ast.If() | ast.While() | ast.IfExp():
            test = _text(node.test)
            yield [node.test], condition
            yield _listed(node.body), test
            yield _listed(node.orelse), condition if isinstance(node, ast.While) else negated(test)
        case ast.BoolOp():
            yield node.values[:1], condition
            yield node.values[1:], _text(node.values[0])
        case ast.Try():
            yield node.body, condition
            for handler in node.handlers:
                caught = "an exception" if handler.type is None else _text(handler.type)
                yield handler.body, f"{caught} is raised"
            yield [*node.orelse, *node.finalbody], condition
        case ast.Match():
            yield [node.subject], condition
            for case in node.cases:
                yield case.body, f"{_text(node.subject)} matches {_text(case.pattern)}"
        case _:
            for _, value in ast.iter_fields(node):
                parts = value if isinstance(value, list) else [value]
                yield [part for part in parts if isinstance(part, ast.AST)], condition


def _in_body(nodes: Sequence[ast.AST], condition: str) -> Iterator[tuple[ast.Call, str]]:
    for node in nodes:
        yield from _in_node(node, condition)
        if isinstance(node, ast.If) and not node.orelse and isinstance(node.body[-1], ast.Return):
            condition = negated(_text(node.test))


def _listed(nodes: ast.AST | Sequence[ast.AST]) -> Sequence[ast.AST]:
    return [nodes] if isinstance(nodes, ast.AST) else nodes


def _text(node: ast.AST) -> str:
    text = " ".join(ast.unparse(node).split())
    return text if len(text) <= _MAXIMUM_LENGTH else f"{text[:_MAXIMUM_LENGTH]}..."
