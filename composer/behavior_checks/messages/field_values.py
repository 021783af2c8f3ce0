"""Checks what a behavior writes into a field, besides its type: frame IDs, and None."""

from __future__ import annotations

import ast

from composer.behavior_checks.messages.elements import parameter_read
from composer.behavior_checks.parts import possible_values
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.field_types import described
from composer.interfaces import Field


def field_problem(node: ast.expr, field: Field, scope: FunctionTypes) -> CodeProblem | None:
    """Return the problem of what is assigned to ``field``, apart from a wrong type; or None."""
    for part in possible_values(node, scope):
        if isinstance(part, ast.Constant) and part.value is None:
            message = f"None where {described(field.type)} is expected"
            return CodeProblem(Kind.VALUE, message, span_of(part, scope.home.source))
    return _frame_problem(node, field.name, scope)


def _frame_problem(node: ast.expr, field: str, scope: FunctionTypes) -> CodeProblem | None:
    """Return the problem of the frame in ``field``: a constant, or a parameter's value.

    Another rule checks the parameters that are named after frames.
    """
    if not field.endswith("frame_id"):
        return None
    parameter = parameter_read(node, scope)
    if parameter is None:
        text, span = getattr(node, "value", None), span_of(node, scope.home.source)
    elif parameter.value is None or parameter.name.value.endswith("frame_id"):
        return None
    else:
        text, span = parameter.value.value, parameter.value.span
    if not isinstance(text, str) or not text.startswith("/"):
        return None
    return CodeProblem(
        Kind.FRAME, f"frame ID '{text}' begins with a slash", span, "remove the slash"
    )
