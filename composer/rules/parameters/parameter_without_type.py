"""A parameter value from which no type can be inferred."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.parameters import describe
from composer.diagnostics import Diagnostic, error

RULE = error(
    code="RC426",
    name="parameter-without-type",
    summary="A parameter is declared with a value from which its type cannot be inferred.",
    why=(
        "ROS parameters are typed. Most values determine the type, but an empty list fits "
        "every array type, and a list of mixed types fits none."
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


def check(context: Context) -> Iterator[Diagnostic]:
    """Check for parameters whose type is neither declared nor inferable."""
    for node in context.system.nodes:
        for parameter in node.parameters:
            if parameter.default is not None and not parameter.type.value:
                name = parameter.name
                yield Diagnostic(
                    RULE,
                    f"cannot infer the type of parameter '{name}' from "
                    f"{describe(parameter.default.value)}",
                    parameter.default.span,
                    hint=f"write '{name}: {{type: ..., default: ...}}'",
                )
