"""Checks how many elements arrays have: array parameters, and fields of a fixed size."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from composer.behavior_checks.messages.lengths import length_of, looks_first, parameter_length
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.values import Parameters
from composer.field_types import described
from composer.interfaces import FieldType
from composer.model import Parameter
from composer.source import Span


def element_problems(
    node: ast.AST, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the elements that an expression or an assignment expects, but its parameter lacks."""
    match node:
        case ast.Subscript(value=owner, slice=index):
            at = integer_constant(index)
            array = scope.type_of(owner)
            size = array.array_size if isinstance(array, FieldType) else None
            if at is not None and size is not None and not -size <= at < size:
                problem = f"{described(array)} has no element {at}"  # type: ignore[arg-type]
                hint = f"indices count from 0, so the last one is {size - 1}"
                yield CodeProblem(Kind.INDEX, problem, span_of(index, scope.home.source), hint)
            parameter = parameter_read(owner, scope)
            if at is None or parameter is None:
                return
            name, count = parameter.name.value, parameter_length(parameter)
            if looks_first(function, name, scope):
                return
            if count is not None and not -count <= at < count:
                yield CodeProblem(
                    Kind.INDEX,
                    f"parameter '{name}' has no element {at}: it has {counted(count)}",
                    span_of(index, scope.home.source),
                    f"indices count from 0, so the last one is {count - 1}" if count else None,
                    cause=_cause(parameter, lambda length: -length <= at < length),
                )
        case ast.Assign(targets=[ast.Tuple(elts=targets) | ast.List(elts=targets)], value=value):
            parameter = parameter_read(value, scope)
            if parameter is None or any(isinstance(item, ast.Starred) for item in targets):
                return
            name, count = parameter.name.value, parameter_length(parameter)
            if count not in (None, len(targets)) and not looks_first(function, name, scope):
                message = f"parameter '{name}' has {counted(count or 0)}, not {len(targets)}"
                span = span_of(value, scope.home.source)
                lines = (function.lineno, function.end_lineno or function.lineno)
                cause = _cause(parameter, lambda length: length == len(targets))
                yield CodeProblem(Kind.INDEX, message, span, lines=lines, cause=cause)


def _cause(parameter: Parameter, fits: Callable[[int], bool]) -> Span | None:
    """Return the value that a system or a file sets, if the default would fit."""
    value, default = parameter.value, parameter.default
    if value is None or default is None or value is default or not isinstance(default.value, list):
        return None
    return value.span if fits(len(default.value)) else None


def size_problem(node: ast.expr, expected: FieldType, scope: FunctionTypes) -> str | None:
    """Return why a list of a known length does not fit a field, None if it may fit."""
    size, bound = expected.array_size, expected.array_bound
    if size is None and bound is None:
        return None
    least, most = length_of(node, scope)
    if size is not None and most is not None and most < size:
        few = "" if least == most else "at most "
        return f"{few}{counted(most)} where {described(expected)} is expected"
    limit = bound if size is None else size
    if limit is None or least <= limit:
        return None
    many = "" if least == most else "at least "
    return f"{many}{counted(least)} where {described(expected)} is expected"


def counted(count: int) -> str:
    """Return ``1 element`` or ``3 elements``."""
    return f"{count} element" + ("" if count == 1 else "s")


def parameter_read(node: ast.expr, scope: FunctionTypes) -> Parameter | None:
    """Return the parameter that an expression such as ``self.parameters.goal`` reads."""
    if isinstance(node, ast.Attribute) and isinstance(scope.type_of(node.value), Parameters):
        return scope.owner.node.parameter(node.attr)
    return None
