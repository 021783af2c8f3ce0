"""A parameter with a value that is not one of its choices."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.judged_parameters import typed_values
from composer.analysis.parameter_values import describe
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register, suggestion

RULE = register(
    Rule(
        code="RC423",
        name="parameter-choice",
        severity=Severity.ERROR,
        summary="A parameter's value is not one of the declared choices.",
        why="The node would refuse the value when it starts.",
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
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look at values that have choices; of a list, each element must be one."""
    for parameter, value in typed_values(context):
        choices = parameter.choices
        if choices is None or value.value in choices.value:
            continue
        items = value.value if isinstance(value.value, list) else [value.value]
        odd = next((item for item in items if item not in choices.value), None)
        if odd is None:
            continue
        yield Diagnostic(
            RULE,
            f"parameter '{parameter.name}' cannot be {describe(odd)}",
            value.span,
            (Label(choices.span, "the choices"),),
            suggestion(str(odd), [str(choice) for choice in choices.value]),
        )
