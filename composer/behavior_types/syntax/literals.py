"""The types of literals."""

from __future__ import annotations

import ast

from composer.behavior_types.values import NONE, Collection, Value
from composer.field_types import ANYTHING, BOOL, INTEGER, NUMBER, STRING


def integer_constant(node: ast.expr) -> int | None:
    """Return the value of an integer literal, None for other expressions."""
    match node:
        case ast.Constant(value=int() as value) if not isinstance(value, bool):
            return value
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() as value)):
            return -value
        case _:
            return None


def constant_type(value: object) -> Value:
    """Return the type of a literal."""
    match value:
        case None:
            return NONE
        case bool():
            return BOOL
        case int():
            return INTEGER
        case float():
            return NUMBER
        case str():
            return STRING
        case bytes():
            return Collection(bytes, INTEGER)
        case _:
            return ANYTHING
