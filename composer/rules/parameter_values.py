"""Types, ranges and choices of parameters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from composer.base.diagnostics import Diagnostic, Label, error, suggestion
from composer.base.source import Located
from composer.language.tree import Plain
from composer.model import USE_SIM_TIME, Parameter, ParameterType
from composer.rules.analysis.context import Context
from composer.rules.analysis.formatting import and_others
from composer.rules.analysis.parameters import (
    KNOWN_TYPES,
    ReportedValues,
    describe,
    is_wrong_choice,
    known_values,
    range_problem,
    type_problem,
    valid_values,
    wrong_choices,
)

PARAMETER_VALUE = error("RC421", "parameter-value")
PARAMETER_DECLARATION = error("RC425", "parameter-declaration")


def check_parameter_type(context: Context) -> Iterator[Diagnostic]:
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
            PARAMETER_VALUE,
            f"parameter '{parameter.name}' must be of type {parameter.type}, not {problem}",
            value.span,
            labels,
            subjects=(("parameter", parameter.name.value),),
        )


def check_parameter_range(context: Context) -> Iterator[Diagnostic]:
    """Check numbers against the declared range."""
    reported = ReportedValues()
    for parameter, value in valid_values(context):
        if _is_contradictory(parameter):
            continue
        problem = range_problem(parameter, value.value)
        if problem is not None and reported.add(parameter, value):
            yield Diagnostic(
                PARAMETER_VALUE,
                f"parameter '{parameter.name}': {problem.message}",
                value.span,
                _label(problem.limit, value, "the limit"),
                subjects=(("parameter", parameter.name.value),),
            )


def _label(cause: Located[Any], value: Located[Plain], text: str) -> tuple[Label, ...]:
    """Return a label for what is declared; QoS policies are declared nowhere."""
    return () if cause.span == value.span else (Label(cause.span, text),)


def _is_contradictory(parameter: Parameter) -> bool:
    low, high = parameter.minimum, parameter.maximum
    return low is not None and high is not None and low.value > high.value


def check_parameter_choice(context: Context) -> Iterator[Diagnostic]:
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
            PARAMETER_VALUE,
            f"parameter '{parameter.name}' cannot be {describe(invalid)}",
            value.span,
            _label(choices, value, "the valid choices"),
            suggestion(str(invalid), [str(choice) for choice in choices.value]),
            (("parameter", parameter.name.value),),
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


def check_parameter_declaration(context: Context) -> Iterator[Diagnostic]:
    """Check the declarations, not the values."""
    for node in context.system.nodes:
        for parameter in node.parameters:
            yield from _wrong_sim_time(parameter)
            if parameter.type.value in KNOWN_TYPES:
                yield from _wrong_range(parameter)
                yield from _choices_of_other_type(parameter)


def _wrong_sim_time(parameter: Parameter) -> Iterator[Diagnostic]:
    kind = parameter.type
    if parameter.name.value == USE_SIM_TIME and kind.value in KNOWN_TYPES - {ParameterType.BOOL}:
        message = (
            f"parameter '{USE_SIM_TIME}', which every node has, must be of type bool, not {kind}"
        )
        yield Diagnostic(PARAMETER_DECLARATION, message, kind.span)


def _wrong_range(parameter: Parameter) -> Iterator[Diagnostic]:
    low, high, step = parameter.minimum, parameter.maximum, parameter.step
    name = parameter.name
    if parameter.type.value not in _WITH_RANGE:
        limits = {"minimum": low, "maximum": high, "step": step}
        for word, limit in limits.items():
            if limit is not None:
                message = f"parameter '{name}' of type {parameter.type} cannot have a {word}"
                yield Diagnostic(PARAMETER_DECLARATION, message, limit.span)
        return
    if low is not None and high is not None and low.value > high.value:
        yield Diagnostic(
            PARAMETER_DECLARATION,
            f"parameter '{name}' has a minimum of {low} above its maximum of {high}",
            low.span,
            (Label(high.span, f"the maximum is {high}"),),
            "swap them",
        )


def _choices_of_other_type(parameter: Parameter) -> Iterator[Diagnostic]:
    wrong = wrong_choices(parameter)
    if parameter.choices is not None and wrong:
        yield Diagnostic(
            PARAMETER_DECLARATION,
            f"parameter '{parameter.name}' of type {parameter.type} has "
            f"{describe(wrong[0])}{and_others(len(wrong) - 1)} among its choices",
            parameter.choices.span,
        )


def check_parameter_without_type(context: Context) -> Iterator[Diagnostic]:
    """Check for parameters whose type is neither declared nor inferable."""
    for node in context.system.nodes:
        for parameter in node.parameters:
            if parameter.default is not None and not parameter.type.value:
                name = parameter.name
                yield Diagnostic(
                    PARAMETER_DECLARATION,
                    f"cannot infer the type of parameter '{name}' from "
                    f"{describe(parameter.default.value)}",
                    parameter.default.span,
                    hint=f"write '{name}: {{type: ..., default: ...}}'",
                )
