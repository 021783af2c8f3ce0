"""A parameter value that is not one of the declared choices."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.parameters import ReportedValues, describe, valid_values
from composer.diagnostics import Diagnostic, Label, error, suggestion

RULE = error(
    code="RC423",
    name="parameter-choice",
    summary="A parameter's value is not one of the declared choices.",
    why="The node refuses the value at startup.",
    bad="""\
system: parameters
nodes:
  motor:
    parameters: {mode: {type: string, default: fats, choices: [slow, fast]}}
""",
    good="""\
system: parameters
nodes:
  motor:
    parameters: {mode: {type: string, default: fast, choices: [slow, fast]}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check values against the choices; each element of a list must be one of them."""
    reported = ReportedValues()
    for parameter, value in valid_values(context):
        choices = parameter.choices
        if choices is None or value.value in choices.value:
            continue
        items = value.value if isinstance(value.value, list) else [value.value]
        invalid = next((item for item in items if item not in choices.value), None)
        if invalid is None or not reported.add(parameter, value):
            continue
        yield Diagnostic(
            RULE,
            f"parameter '{parameter.name}' cannot be {describe(invalid)}",
            value.span,
            (Label(choices.span, "the valid choices"),),
            suggestion(str(invalid), [str(choice) for choice in choices.value]),
        )
