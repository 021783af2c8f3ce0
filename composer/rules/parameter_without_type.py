"""A bare value that does not tell the type of the parameter it declares."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.parameter_values import describe
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC426",
        name="parameter-without-type",
        severity=Severity.ERROR,
        summary="A parameter is declared by a value that does not tell its type.",
        why=(
            "ROS parameters are typed. Most values tell their type; an empty list could be one of "
            "anything, and a list of numbers and texts is none at all."
        ),
        bad="""\
system: parameters
nodes:
  driver:
    parameters: {waypoints: []}
""",
        good="""\
system: parameters
nodes:
  driver:
    parameters: {waypoints: {type: double_array, default: []}}
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look for parameters that were declared without a type that could be found out."""
    for node in context.system.nodes:
        for parameter in node.parameters:
            if parameter.default is not None and not parameter.type.value:
                name = parameter.name
                yield Diagnostic(
                    RULE,
                    f"parameter '{name}' is declared by {describe(parameter.default.value)}, "
                    "which does not tell its type",
                    parameter.default.span,
                    hint=f"write '{name}: {{type: ..., default: ...}}'",
                )
