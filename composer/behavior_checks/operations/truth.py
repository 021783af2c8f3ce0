"""Conditions that are always true, or that fail: functions, and arrays of numpy."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.parts import uses_numpy
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.functions import is_function
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import ModuleFunction, OwnMethod
from composer.field_types import ANYTHING

#: The nodes that test something.
TESTING = (
    *(ast.Assert, ast.BoolOp, ast.Call, ast.Compare, ast.If, ast.IfExp, ast.UnaryOp, ast.While),
    ast.comprehension,
)


def truth_problems(
    node: ast.AST, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the methods that a condition tests without a call, as in ``if sensor.is_ready``."""
    yield from constant_problems(node, scope)
    if uses_numpy(scope.home):
        yield from _arrays(node, scope)
    for test in _tested(node):
        name = _always_true(test, scope)
        # 'if self.hook: self.hook()' expects that there may be none
        if name and not _is_called(test, function):
            message = f"the function '{name}' is not called, so that this is always true"
            span = span_of(test, scope.home.source)
            yield CodeProblem(Kind.VALUE, message, span, f"call it: {name}()")


def _arrays(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the arrays of numpy in conditions: which element counts is not clear."""
    tested = [*_tested(node)]
    match node:
        case ast.BoolOp(values=[*first, _]):
            tested += first
        case ast.Compare(left=left, comparators=[*others]) if len(others) > 1:
            tested += [item for item in (left, *others) if scope.type_of(item) == ARRAY][:1]
    from composer.behavior_checks.operations.array_shapes import (  # noqa: PLC0415 (start-up time)
        is_array,
    )

    for test in tested:
        if is_array(test, scope):
            message = "an array of numpy is neither true nor false"
            hint = "write .any() or .all(), or ask for its .size"
            if isinstance(node, ast.BoolOp):
                sign = "&" if isinstance(node.op, ast.And) else "|"
                hint = f"combine arrays by '{sign}', with each comparison in parentheses"
            yield CodeProblem(Kind.VALUE, message, span_of(test, scope.home.source), hint)
            return


def constant_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the conditions that do not depend on anything, by a slip such as ``a == 1 or 2``."""
    source = scope.home.source
    match node:
        case ast.Assert(test=ast.Tuple(elts=[_, *_]) as pair):
            message = "a tuple is always true"
            yield CodeProblem(Kind.UNUSED, message, span_of(pair, source), "remove the parentheses")
        case ast.Compare(ops=operators, comparators=others):
            for operator, other in zip(operators, others, strict=True):
                if isinstance(operator, ast.Is | ast.IsNot) and _is_literal(other):
                    message = "'is' asks for the same object, not for an equal value"
                    sign = "==" if isinstance(operator, ast.Is) else "!="
                    yield CodeProblem(
                        Kind.UNUSED, message, span_of(other, source), f"compare by '{sign}'"
                    )
    for test in _tested(node):
        if not isinstance(test, ast.Constant):
            continue
        if isinstance(test.value, str) and test.value and _is_alternative(test, node):
            message = "this is always true: it is not compared with anything"
            hint = f"write '... == {ast.unparse(test)}' for each value"
            yield CodeProblem(Kind.UNUSED, message, span_of(test, source), hint)


def _is_literal(node: ast.expr) -> bool:
    is_simple = isinstance(node, ast.Constant) and type(node.value) in (bytes, float, int, str)
    return is_simple or isinstance(node, ast.Dict | ast.List | ast.Tuple)


def _is_alternative(test: ast.expr, node: ast.AST) -> bool:
    """Return whether an expression follows a comparison in an 'or'."""
    return any(
        isinstance(other, ast.BoolOp)
        and isinstance(other.op, ast.Or)
        and isinstance(other.values[0], ast.Compare)
        and any(value is test for value in other.values)
        for other in ast.walk(node)
    )


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
    found = scope.type_of(node) if isinstance(node, ast.Attribute) else ANYTHING
    if not isinstance(node, ast.Attribute) or not is_function(found):
        return ""
    if isinstance(found, OwnMethod | ModuleFunction):
        # an object may get an attribute that hides the method of its class
        if node.attr in scope.owner.project_classes.assigned_outside:
            return ""
        if isinstance(found, OwnMethod) and node.attr in scope.owner.assigned:
            return ""
    if isinstance(found, ModuleFunction):
        is_method = found.is_bound and (found.of is not None or is_rclpy(found.home))
        return node.attr if is_method else ""
    return node.attr


def _is_called(node: ast.expr, function: Function) -> bool:
    name = dotted(node)
    return not name or any(
        isinstance(other, ast.Call) and dotted(other.func) == name for other in nodes_of(function)
    )
