"""Checks a call against the parameters of what it calls."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from inspect import isabstract

from composer.behavior_checks.annotated_values import argument_problem, problem_place
from composer.behavior_checks.calls.arguments import Signature, signature_of_function
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of, start_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.scalars import is_scalar
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.values import (
    AnyFunction,
    ApiValue,
    BuiltinObject,
    Collection,
    OwnObject,
    Parameters,
    Pending,
    Ports,
    Value,
)
from composer.field_types import described
from composer.interfaces import FieldType, Message


def call_problems(
    call: ast.Call,
    signature: Signature,
    scope: FunctionTypes,
    expected: Mapping[str, Value] | None = None,
) -> Iterator[CodeProblem]:
    """Yield why a call fails: its arguments, or one that contradicts an ``expected`` type."""
    source = scope.home.source
    problem = signature.problem(call)
    if problem is not None:
        message, node, hint = problem
        if isinstance(node, ast.keyword):
            span = start_span(node, len(str(node.arg)), source)
        else:
            span = span_of(node, source)
        yield CodeProblem(Kind.CALL, message, span, hint)
        return
    for name, argument in signature.bound(call):
        if expected is not None and name in expected:
            wrong = argument_problem(
                argument, scope.type_of(argument), expected[name], scope.type_of
            )
            if wrong is not None:
                message = f"argument '{name}' of '{signature.name}': {wrong}"
                place = problem_place(argument, expected[name], scope.type_of)
                yield CodeProblem(Kind.CALL, message, span_of(place, source))
                return  # arguments that are swapped are one mistake
            wanted = expected[name]
            if isinstance(wanted, AnyFunction) and wanted.arguments is not None:
                yield from function_problems(argument, len(wanted.arguments), scope)


def function_problems(node: ast.expr, count: int, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield that what is passed cannot be called with that many arguments, or at all."""
    reason = uncallable(scope.type_of(node))
    if reason is not None:
        yield CodeProblem(Kind.CALL, reason[0], span_of(node, scope.home.source))
        return
    signature = signature_of_function(node, scope.type_of(node))
    if signature is not None and not signature.accepts(count):
        counted = f"{count} argument{'' if count == 1 else 's'}" if count else "no argument"
        problem = f"this function is called with {counted}"
        yield CodeProblem(Kind.CALL, problem, span_of(node, scope.home.source))


def uncallable(value: Value) -> tuple[str, str | None] | None:
    """Return why a value cannot be called, and a hint; None if it may be."""
    match value:
        case ApiValue(class_name="Publisher"):
            return "a Publisher is not a function", "call its method 'publish'"
        case ApiValue(class_name=name):
            return f"a {name} is not a function", None
        case Ports() | Parameters():
            return "this is not a function", None
        case Message(name=name):
            return f"{name} is not a function", None
        case OwnObject(of=of):
            known = known_attributes(of)
            is_callable = known is None or "__call__" in known
            return None if is_callable else (f"a {of.definition.name} is not a function", None)
        case Collection(python=python) if not isabstract(python):
            return f"a {python.__name__} is not a function", None
        case FieldType() if is_scalar(value) or value.is_array:
            return f"{described(value)} is not a function", None
        case BuiltinObject() if value == ARRAY:
            return "an array of numpy is not a function", "write [...] for an index"
        case Pending(name=name):
            return f"what '{name}' returns is awaited, not called", None
        case _:
            return None
