"""Types, ranges, choices and lengths of parameters."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Any

from composer.base.characters import counted
from composer.base.diagnostics import Diagnostic, Label, error, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span
from composer.language.tree import Plain
from composer.model import USE_SIM_TIME, Parameter, ParameterType
from composer.python_code.lookup import BehaviorSource
from composer.python_code.syntax import scopes_in
from composer.python_code.trees import dotted, span_of
from composer.rules.analysis.context import Context, behaviors
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
from composer.rules.expressions import INDEX_OUT_OF_RANGE

PARAMETER_VALUE = error("RC421", "parameter-value")
PARAMETER_DECLARATION = error("RC425", "parameter-declaration")
_WITH_RANGE = frozenset(
    {
        ParameterType.INTEGER,
        ParameterType.DOUBLE,
        ParameterType.INTEGER_ARRAY,
        ParameterType.DOUBLE_ARRAY,
        ParameterType.BYTE_ARRAY,
    }
)


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


@dataclass(frozen=True, slots=True)
class _Unpacking:
    """Code that assigns an array parameter to several names; to no fewer, or to so many."""

    parameter: str
    names: int
    is_least: bool
    span: Span

    def fits(self, length: int) -> bool:
        """Return whether an array of this length can be assigned."""
        return length >= self.names if self.is_least else length == self.names


def check_unpacked_parameters(context: Context) -> Iterator[Diagnostic]:
    """Check the lengths of arrays that a behavior assigns to several names."""
    reported = ReportedValues()
    by_source: dict[int, list[_Unpacking]] = {}
    for node, source in behaviors(context):
        if id(source) not in by_source:
            by_source[id(source)] = list(_unpackings(source))
        for unpacking in by_source[id(source)]:
            parameter = node.parameter(unpacking.parameter)
            value = parameter.value if parameter is not None else None
            if parameter is None or value is None or not isinstance(value.value, list):
                continue
            length = len(value.value)
            if not unpacking.fits(length) and reported.add(parameter, value):
                least = "at least " if unpacking.is_least else ""
                yield Diagnostic(
                    INDEX_OUT_OF_RANGE,
                    f"parameter '{parameter.name}' has {counted(length, 'element')}, but the "
                    f"behavior assigns it to {least}{counted(unpacking.names, 'name')}",
                    value.span,
                    (Label(unpacking.span, "here"),),
                )


def _unpackings(source: BehaviorSource) -> Iterator[_Unpacking]:
    for scope in scopes_in(source.classes):
        if any(
            isinstance(item, ast.Try) or getattr(item, "id", "") == "len" for item in scope.nodes
        ):
            continue  # the code may know
        for item in scope.nodes:
            match item:
                case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Attribute() as array):
                    owner, _, name = dotted(array).rpartition(".")
                    starred = sum(isinstance(each, ast.Starred) for each in names)
                    if owner == "self.parameters":
                        span = span_of(array, scope.source)
                        yield _Unpacking(name, len(names) - starred, starred > 0, span)
