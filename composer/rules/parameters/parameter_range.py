"""A parameter value outside its range."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.parameters import ReportedValues, range_problem, valid_values
from composer.diagnostics import Diagnostic, Label, error
from composer.model import Parameter

RULE = error(
    code="RC422",
    name="parameter-range",
    summary="A parameter's value violates the declared minimum, maximum or step.",
    why="The node refuses the value at startup.",
    bad="""\
system: parameters
nodes:
  motor:
    parameters:
      max_velocity: {type: double, default: 9.0, minimum: 0.0, maximum: 5.0, unit: m/s}
""",
    good="""\
system: parameters
nodes:
  motor:
    parameters:
      max_velocity: {type: double, default: 5.0, minimum: 0.0, maximum: 5.0, unit: m/s}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check numbers against the declared range."""
    reported = ReportedValues()
    for parameter, value in valid_values(context):
        if _is_contradictory(parameter):
            continue
        problem = range_problem(parameter, value.value)
        if problem is not None and reported.add(parameter, value):
            yield Diagnostic(
                RULE,
                f"parameter '{parameter.name}': {problem.message}",
                value.span,
                (Label(problem.limit.span, "the limit"),),
            )


def _is_contradictory(parameter: Parameter) -> bool:
    low, high = parameter.minimum, parameter.maximum
    return low is not None and high is not None and low.value > high.value
