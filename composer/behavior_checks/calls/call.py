"""Checks a call against the parameters of what it calls."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.behavior_checks.calls.arguments import Signature, signature_of_function
from composer.behavior_checks.fitting import argument_problem
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of, start_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.values import AnyFunction, Value


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
                yield CodeProblem(Kind.CALL, message, span_of(argument, source))
                return  # arguments that are swapped are one mistake
            wanted = expected[name]
            if isinstance(wanted, AnyFunction) and wanted.arguments is not None:
                yield from function_problems(argument, len(wanted.arguments), scope)


def function_problems(node: ast.expr, count: int, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield that a function is passed that cannot be called with that many arguments."""
    signature = signature_of_function(node, scope.type_of(node))
    if signature is not None and not signature.accepts(count):
        counted = f"{count} argument{'' if count == 1 else 's'}" if count else "no argument"
        problem = f"this function is called with {counted}"
        yield CodeProblem(Kind.CALL, problem, span_of(node, scope.home.source))
