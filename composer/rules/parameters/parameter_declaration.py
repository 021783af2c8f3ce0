"""A parameter declaration that no value can satisfy."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.formatting import and_others
from composer.analysis.parameters import KNOWN_TYPES, describe, wrong_choices
from composer.diagnostics import Diagnostic, Label, error
from composer.model import USE_SIM_TIME, Parameter, ParameterType

RULE = error(
    code="RC425",
    name="parameter-declaration",
    summary="A parameter's declaration contradicts itself.",
    why=(
        "A minimum above the maximum leaves no valid value, a range applies only to numbers, "
        "and a choice of another type can never be selected."
    ),
    bad="""\
system: parameters
nodes:
  motor:
    parameters: {max_velocity: {type: double, default: 3.0, minimum: 5.0, maximum: 1.0}}
""",
    good="""\
system: parameters
nodes:
  motor:
    parameters: {max_velocity: {type: double, default: 3.0, minimum: 1.0, maximum: 5.0}}
""",
)

_WITH_RANGE = frozenset(
    {
        ParameterType.INTEGER,
        ParameterType.DOUBLE,
        ParameterType.INTEGER_ARRAY,
        ParameterType.DOUBLE_ARRAY,
        ParameterType.BYTE_ARRAY,
    }
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the declarations, not the values."""
    for node in context.system.nodes:
        for parameter in node.parameters:
            yield from _of_every_node(parameter)
            if parameter.type.value in KNOWN_TYPES:
                yield from _range(parameter)
                yield from _choices(parameter)


def _of_every_node(parameter: Parameter) -> Iterator[Diagnostic]:
    kind = parameter.type
    if parameter.name.value == USE_SIM_TIME and kind.value in KNOWN_TYPES - {ParameterType.BOOL}:
        message = (
            f"parameter '{USE_SIM_TIME}', which every node has, must be of type bool, not {kind}"
        )
        yield Diagnostic(RULE, message, kind.span)


def _range(parameter: Parameter) -> Iterator[Diagnostic]:
    low, high, step = parameter.minimum, parameter.maximum, parameter.step
    name = parameter.name
    if parameter.type.value not in _WITH_RANGE:
        limits = {"minimum": low, "maximum": high, "step": step}
        for word, limit in limits.items():
            if limit is not None:
                message = f"parameter '{name}' of type {parameter.type} cannot have a {word}"
                yield Diagnostic(RULE, message, limit.span)
        return
    if low is not None and high is not None and low.value > high.value:
        yield Diagnostic(
            RULE,
            f"parameter '{name}' has a minimum of {low} above its maximum of {high}",
            low.span,
            (Label(high.span, f"the maximum is {high}"),),
            "swap them",
        )


def _choices(parameter: Parameter) -> Iterator[Diagnostic]:
    wrong = wrong_choices(parameter)
    if parameter.choices is not None and wrong:
        yield Diagnostic(
            RULE,
            f"parameter '{parameter.name}' of type {parameter.type} has "
            f"{describe(wrong[0])}{and_others(len(wrong) - 1)} among its choices",
            parameter.choices.span,
        )
