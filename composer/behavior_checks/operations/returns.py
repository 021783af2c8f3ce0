"""Checks what a function returns against its annotation, and against what the composer expects."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.annotated_values import argument_problem
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.flow import (
    empty_returns,
    is_stub,
    may_raise_at_end,
    reaches_end,
    returned_values,
    yields,
)
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.syntax import name_span
from composer.behavior_types.expressions.annotations import allows_none, annotated
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.functions import definition_of
from composer.behavior_types.libraries.handlers import TRANSITIONS, Handler
from composer.behavior_types.libraries.standard_types import ITERATORS
from composer.behavior_types.scalars import is_float, is_integer
from composer.behavior_types.values import (
    NONE,
    ApiMethod,
    Collection,
    CollectionMethod,
    OwnObject,
    Pending,
    Value,
)
from composer.field_types import ANYTHING, BOOL
from composer.interfaces import FieldType, Message


def return_problems(
    function: Function, scope: FunctionTypes, handler: Handler | None
) -> Iterator[CodeProblem]:
    """Yield what is wrong with the values that a function returns, or does not return.

    What a handler of a service or an action returns is checked as a message, by the caller.
    """
    if handler is not None and handler.returns is NONE:
        yield from _unused(function, scope)
        return
    annotation = function.returns
    if annotation is None or is_stub(function):
        return
    expected = annotated(annotation, scope.home, scope.owner.node, scope.owner.interfaces)
    is_message = handler is not None and isinstance(handler.returns, Message)
    if not is_message and expected is not NONE:
        yield from _wrong(function, scope, expected)
    if allows_none(annotation) or function.name.startswith("accept_"):
        return
    if isinstance(expected, Message | FieldType | OwnObject | Collection):
        yield from _missing(function, scope, expected, is_certain=is_message)


def must_return(function: Function, scope: FunctionTypes, expected: Value) -> Iterator[CodeProblem]:
    """Yield what is wrong with what a function returns to rclpy, which expects that type."""
    if expected is NONE or expected is ANYTHING:
        yield from return_problems(function, scope, None)
        return
    if is_stub(function) or _yields(function):
        return
    if not isinstance(expected, Message):  # its fields are checked by the caller
        yield from _wrong(function, scope, expected)
    yield from _empty(function, scope, expected)
    if reaches_end(function):
        yield _without_end(function, scope, expected)


def _missing(
    function: Function, scope: FunctionTypes, expected: Value, *, is_certain: bool
) -> Iterator[CodeProblem]:
    """Yield where a function returns None. What ends in a loop or a call may know better.

    The handler of an action has to return a result in any case, unless it may raise instead.
    """
    if isinstance(expected, Collection) and _yields(function):
        return
    yield from _empty(function, scope, expected)
    is_certain = is_certain and not any(
        isinstance(node, ast.Raise) for node in ast.walk(function.body[-1])
    )
    ends = is_certain or not may_raise_at_end(function, lambda call: _returns(call, scope))
    if reaches_end(function) and ends:
        yield _without_end(function, scope, expected)


def _returns(call: ast.Call, scope: FunctionTypes) -> bool:
    """Return whether a call is known to return: it does not raise at its end."""
    called = scope.type_of(call.func)
    if isinstance(called, ApiMethod | CollectionMethod):
        return True
    function = definition_of(called)
    if function is None or function.decorator_list or is_stub(function):
        return False
    return reaches_end(function) and not may_raise_at_end(function)


def _empty(function: Function, scope: FunctionTypes, expected: Value) -> Iterator[CodeProblem]:
    for statement in empty_returns(function):
        span = span_of(statement, scope.home.source)
        message = f"'{function.name}' returns {shown(expected)}, not None"
        yield CodeProblem(Kind.RETURN, message, span, "return a value")


def _without_end(function: Function, scope: FunctionTypes, expected: Value) -> CodeProblem:
    problem = f"'{function.name}' returns {shown(expected)}, but may end without a 'return'"
    span = name_span(function, "def", scope.home.source)
    return CodeProblem(Kind.RETURN, problem, span, "return a value at its end")


def _wrong(function: Function, scope: FunctionTypes, expected: Value) -> Iterator[CodeProblem]:
    """Yield the returned values that contradict the annotation."""
    if _yields(function):
        yield from _wrong_elements(function, scope, expected)
        return
    for value in returned_values(function):
        found = scope.type_of(value)
        if isinstance(found, Pending):
            continue
        problem = argument_problem(value, found, expected, scope.type_of)
        if problem is None and _is_iterator(found) and _is_concrete(expected):
            problem = f"{shown(found)} where {shown(expected)} is expected"
        if problem is None and is_float(found) and (is_integer(expected) or expected == BOOL):
            problem = f"{shown(found)} where {shown(expected)} is expected"
        if problem is not None:
            message = f"the result of '{function.name}': {problem}"
            yield CodeProblem(Kind.RETURN, message, span_of(value, scope.home.source))


def _wrong_elements(
    function: Function, scope: FunctionTypes, expected: Value
) -> Iterator[CodeProblem]:
    """Yield the values that a generator yields although its annotation names others."""
    if not isinstance(expected, Collection):
        return
    for node in yields(function):
        if isinstance(node, ast.Yield) and node.value is not None:
            found = scope.type_of(node.value)
            problem = argument_problem(node.value, found, expected.element, scope.type_of)
            if problem is not None:
                message = f"'{function.name}' yields {problem}"
                yield CodeProblem(Kind.RETURN, message, span_of(node.value, scope.home.source))


def _unused(function: Function, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the messages that a handler returns, although nothing uses them."""
    for value in returned_values(function):
        if isinstance(scope.type_of(value), Message):
            span = span_of(value, scope.home.source)
            message = f"what '{function.name}' returns is not used"
            yield CodeProblem(
                Kind.UNUSED, message, span, "publish it: self.publishers.NAME.publish"
            )


def transition_results(function: Function, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield what a handler of a transition returns that is neither None nor a bool."""
    if function.name not in TRANSITIONS:
        return
    for value in returned_values(function):
        found = scope.type_of(value)
        is_of_rclpy = dotted(value).rpartition(".")[0].endswith("TransitionCallbackReturn")
        if is_of_rclpy or (kind_of(found) is not None and found != BOOL):
            message = f"'{function.name}' returns {ast.unparse(value)}, which is an error"
            hint = "return nothing; to refuse the transition, raise TransitionFailed"
            yield CodeProblem(Kind.RETURN, message, span_of(value, scope.home.source), hint)


def _is_iterator(found: Value) -> bool:
    """Return whether a value can be iterated over only once."""
    return isinstance(found, Collection) and found.python in ITERATORS


def _is_concrete(expected: Value) -> bool:
    return isinstance(expected, Collection) and expected.python in (dict, list, set, tuple)


def _yields(function: Function) -> bool:
    return any(isinstance(node, ast.Yield | ast.YieldFrom) for node in ast.walk(function))
