"""Bools and numbers of numpy in fields for bools, which ROS publishes as False."""

from __future__ import annotations

import ast

from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_types import ARRAY

_TESTS = frozenset({"numpy.all", "numpy.any", "numpy.bool_", "numpy.float64"})
_NUMBERS = frozenset(
    {"numpy.float64", "numpy.linalg.norm", "numpy.max", "numpy.mean", "numpy.median", "numpy.min"}
    | {"numpy.std", "numpy.sum", "numpy.var"}
)
_NUMBERS_OF_ARRAYS = frozenset({"max", "mean", "min", "std", "sum", "var"})
_OTHERS = (ast.In, ast.Is, ast.IsNot, ast.NotIn)


def numpy_problem(node: ast.expr, scope: FunctionTypes) -> tuple[str, str] | None:
    """Return why a value does not fit a field for a bool, and a hint; None if it may fit."""
    value = _written(node, scope)
    match value:
        case ast.Call() if _is_result(value, _TESTS, frozenset({"all", "any"}), scope):
            pass
        case ast.Compare(left=left, ops=[sign], comparators=[right]) if not isinstance(
            sign, _OTHERS
        ):
            if not _is_number(left, scope) and not _is_number(right, scope):
                return None
        case _:
            return None
    return "a value of numpy where bool is expected", "write bool(...); ROS publishes False for it"


def _written(node: ast.expr, scope: FunctionTypes) -> ast.expr | None:
    """Return what a name is bound to, None if that is not known; or another expression itself."""
    return scope.bindings.value_of(node.id) if isinstance(node, ast.Name) else node


def _is_number(node: ast.expr, scope: FunctionTypes) -> bool:
    value = _written(node, scope)
    return isinstance(value, ast.Call) and _is_result(value, _NUMBERS, _NUMBERS_OF_ARRAYS, scope)


def _is_result(
    call: ast.Call, functions: frozenset[str], methods: frozenset[str], scope: FunctionTypes
) -> bool:
    """Return whether a call of one of these functions, or methods of arrays, gives one value."""
    if scope.called_name(call.func) in functions:
        return True
    match call.func:
        case ast.Attribute(value=owner, attr=name):
            return name in methods and scope.type_of(owner) == ARRAY
        case _:
            return False
