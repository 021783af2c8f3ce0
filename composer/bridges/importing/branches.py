"""On which conditions the calls of a function depend."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from typing import NamedTuple

_MAXIMUM_LENGTH = 60


class Condition(NamedTuple):
    """What is true if a call is made, as code; "" if the call is always made."""

    code: str = ""
    opposite: str = ""

    @property
    def negated(self) -> Condition:
        """The opposite condition."""
        return Condition(self.opposite, self.code)

    def __str__(self) -> str:
        is_short = len(self.code) <= _MAXIMUM_LENGTH
        return self.code if is_short else f"{self.code[:_MAXIMUM_LENGTH]}..."


ALWAYS = Condition()


def conditions_of_calls(function: ast.AST) -> dict[ast.Call, Condition]:
    """Return the innermost condition of each call that may not be made.

    A call in an exception handler depends on an exception. What follows a branch that returns
    depends on its condition as well. A loop is not a condition.
    """
    return dict(_in_node(function, ALWAYS))


def _in_node(node: ast.AST, condition: Condition) -> Iterator[tuple[ast.Call, Condition]]:
    if isinstance(node, ast.Call) and condition != ALWAYS:
        yield node, condition
    for nodes, inner in _parts(node, condition):
        yield from _in_body(nodes, inner)


def _parts(node: ast.AST, condition: Condition) -> Iterator[tuple[Sequence[ast.AST], Condition]]:
    """Yield the parts of a node, each with its condition."""
    match node:
        case ast.If() | ast.While() | ast.IfExp():
            test = _condition(node.test)
            yield [node.test], condition
            yield _listed(node.body), test
            yield _listed(node.orelse), condition if isinstance(node, ast.While) else test.negated
        case ast.BoolOp():
            first = _condition(node.values[0])
            yield node.values[:1], condition
            yield node.values[1:], first.negated if isinstance(node.op, ast.Or) else first
        case ast.Try():
            yield node.body, condition
            for handler in node.handlers:
                caught = "an exception" if handler.type is None else _code(handler.type)
                yield handler.body, Condition(f"{caught} is raised")
            yield [*node.orelse, *node.finalbody], condition
        case ast.Match():
            yield [node.subject], condition
            for case in node.cases:
                matched = f"{_code(node.subject)} matches {_code(case.pattern)}"
                yield case.body, Condition(matched)
        case _:
            for _, value in ast.iter_fields(node):
                parts = value if isinstance(value, list) else [value]
                yield [part for part in parts if isinstance(part, ast.AST)], condition


def _in_body(
    nodes: Sequence[ast.AST], condition: Condition
) -> Iterator[tuple[ast.Call, Condition]]:
    for node in nodes:
        yield from _in_node(node, condition)
        if isinstance(node, ast.If) and not node.orelse and isinstance(node.body[-1], ast.Return):
            condition = _condition(node.test).negated


def _listed(nodes: ast.AST | Sequence[ast.AST]) -> Sequence[ast.AST]:
    return [nodes] if isinstance(nodes, ast.AST) else nodes


def _condition(test: ast.expr) -> Condition:
    """Return an expression as a condition; ``not not x`` is the same as ``x``."""
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return _condition(test.operand).negated
    return Condition(_code(test), _code(ast.UnaryOp(ast.Not(), test)))


def _code(node: ast.AST) -> str:
    return " ".join(ast.unparse(node).split())
