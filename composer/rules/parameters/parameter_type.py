"""A parameter value of the wrong type."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.parameters import ReportedValues, is_wrong_choice, known_values, type_problem
from composer.diagnostics import Diagnostic, Label, error

RULE = error(
    code="RC421",
    name="parameter-type",
    summary="A parameter's value does not have the declared type.",
    why=(
        "ROS parameters are typed, so the node refuses the value at startup. An integer is "
        "accepted for a double; nothing else is converted."
    ),
    bad="""\
system: parameters
nodes:
  motor:
    parameters: {max_velocity: {type: double, default: fast}}
""",
    good="""\
system: parameters
nodes:
  motor:
    parameters: {max_velocity: {type: double, default: 1.0}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the defaults and the values that instances set."""
    reported = ReportedValues()
    for parameter, value in known_values(context):
        problem = type_problem(value.value, parameter.type.value)
        if problem is None or is_wrong_choice(parameter, value.value):
            continue  # another rule reports choices of another type
        if not reported.add(parameter, value):
            continue
        labels: tuple[Label, ...] = ()
        if value is not parameter.default:
            labels = (Label(parameter.name.span, f"declared as {parameter.type}"),)
        yield Diagnostic(
            RULE,
            f"parameter '{parameter.name}' must be of type {parameter.type}, not {problem}",
            value.span,
            labels,
        )
