"""Checks the frame IDs that a behavior writes into messages."""

from __future__ import annotations

import ast

from composer.behavior_source.spans import span_of
from composer.behavior_types.elements import parameter_read
from composer.behavior_types.expressions import FunctionTypes
from composer.behavior_types.problems import CodeProblem, Kind


def frame_problem(node: ast.expr, field: str, scope: FunctionTypes) -> CodeProblem | None:
    """Return the problem of what is assigned to ``field``: a constant, or a parameter's value.

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
