"""Functions that are tested as if they were values: they are always true."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import (
    ApiMethod,
    BuiltinMethod,
    Collection,
    CollectionMethod,
    ModuleFunction,
    OwnMethod,
)

#: The nodes that test something.
TESTING = (ast.Assert, ast.Call, ast.If, ast.IfExp, ast.UnaryOp, ast.While, ast.comprehension)


def truth_problems(
    node: ast.AST, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the methods that a condition tests without a call, as in ``if sensor.is_ready``."""
    for test in _tested(node):
        name = _always_true(test, scope)
        # 'if self.hook: self.hook()' expects that there may be none
        if name and not _is_called(test, function):
            message = f"the function '{name}' is not called, so that this is always true"
            span = span_of(test, scope.home.source)
            yield CodeProblem(Kind.VALUE, message, span, f"call it: {name}()")


def _tested(node: ast.AST) -> Iterator[ast.expr]:
    """Yield the expressions of which only the truth matters."""
    match node:
        case (
            ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test) | ast.Assert(test=test)
        ):
            yield from _parts(test)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield from _parts(operand)
        case ast.comprehension(ifs=tests):
            for test in tests:
                yield from _parts(test)
        case ast.Call(
            func=ast.Name(id="all" | "any"),
            args=[ast.GeneratorExp(elt=item) | ast.ListComp(elt=item)],
        ):
            yield from _parts(item)


def _parts(test: ast.expr) -> Iterator[ast.expr]:
    if isinstance(test, ast.BoolOp):
        for value in test.values:
            yield from _parts(value)
    else:
        yield test


def _always_true(node: ast.expr, scope: FunctionTypes) -> str:
    """Return the name of the method that an expression is, "" if it may be anything else."""
    if not isinstance(node, ast.Attribute):
        return ""
    # an object may get an attribute that hides the method of its class
    is_replaced = node.attr in scope.owner.project_classes.assigned_outside
    match scope.type_of(node):
        case OwnMethod():
            is_method = not is_replaced and node.attr not in scope.owner.assigned
        case ModuleFunction(home=home, of=of, is_bound=is_bound):
            is_method = not is_replaced and is_bound and (of is not None or is_rclpy(home))
        case ApiMethod():
            is_method = True
        case CollectionMethod(owner=Collection(python=python)) | BuiltinMethod(python=python):
            is_method = callable(getattr(python, node.attr, None))
        case _:
            is_method = False
    return node.attr if is_method else ""


def _is_called(node: ast.expr, function: Function) -> bool:
    name = dotted(node)
    return not name or any(
        isinstance(other, ast.Call) and dotted(other.func) == name for other in nodes_of(function)
    )
