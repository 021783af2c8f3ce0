"""Checks values against the fields, ports and arrays of messages that they are for."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.fitting import value_problem
from composer.behavior_checks.messages.elements import size_problem
from composer.behavior_checks.messages.field_values import field_problem
from composer.behavior_checks.operations.awaiting import missing_await
from composer.behavior_checks.parts import possible_values
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.spans import span_of, start_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.scalars import is_number
from composer.behavior_types.values import Pending, Value
from composer.diagnostics import suggestion
from composer.fast_dataclass import dataclass
from composer.field_types import described
from composer.interfaces import Field, FieldType, Message
from composer.source import Span


@dataclass(frozen=True, slots=True)
class ValueChecker:
    """Checks the values in one function."""

    scope: FunctionTypes
    function: Function

    def created(self, node: ast.Call, message: Message) -> Iterator[CodeProblem]:
        """Yield why a message cannot be created so."""
        for argument in node.args:
            if not isinstance(argument, ast.Starred):
                problem = f"{message.name} takes keyword arguments only"
                fields = ", ".join(f"{name}=..." for name in message.field_names[:3])
                hint = f"fields: {fields}" if fields else None
                yield CodeProblem(Kind.VALUE, problem, self._span(argument), hint)
                return
        for keyword in node.keywords:
            if keyword.arg is None:
                continue
            field = message.field(keyword.arg)
            if field is not None:
                yield from self.field(keyword.value, field)
            elif keyword.arg != "check_fields":
                problem = f"{message.name} has no field '{keyword.arg}'"
                hint = suggestion(keyword.arg, message.field_names)
                span = start_span(keyword, len(keyword.arg), self.scope.home.source)
                yield CodeProblem(Kind.FIELD, problem, span, hint)
                return  # more of them come from the wrong class

    def added(self, node: ast.Call) -> Iterator[CodeProblem]:
        """Check what ``append`` and ``insert`` add to a list in a message."""
        if isinstance(node.func, ast.Attribute) and node.func.attr in {"append", "insert"}:
            array = self.scope.type_of(node.func.value)
            if isinstance(array, FieldType) and array.is_array and node.args:
                yield from self.value(node.args[-1], array.element)

    def field(self, node: ast.expr, field: Field) -> Iterator[CodeProblem]:
        """Yield why an expression does not fit a field of a message."""
        problem = field_problem(node, field, self.scope)
        if problem is not None:
            yield problem
        else:
            yield from self.value(node, field.type)

    def value(self, node: ast.expr, expected: Value) -> Iterator[CodeProblem]:
        """Yield why an expression does not fit ``expected``."""
        for part in possible_values(node, self.scope):
            found = list(self._part(part, expected))
            yield from found
            if found:
                return  # the other parts have the same cause

    def _part(self, node: ast.expr, expected: Value) -> Iterator[CodeProblem]:
        found = self.scope.type_of(node)
        if isinstance(found, Pending):
            yield missing_await(found, self.function, self.scope)
            return
        if isinstance(node, ast.List | ast.Tuple) and isinstance(expected, FieldType):
            is_checked = expected.is_array and expected.name != "byte"
            items = [item for item in node.elts if not isinstance(item, ast.Starred)]
            items = items if is_checked else []
            wrong = (problem for item in items for problem in self.value(item, expected.element))
            first = next(wrong, None)  # the others have the same cause
            if first is not None:
                yield first
                return
        problem = value_problem(node, found, expected, self.scope.owner.interfaces)
        if problem is None and isinstance(expected, FieldType) and found == ARRAY:
            problem = _dimensions(node, expected, self.scope)
        if problem is None and isinstance(expected, FieldType):
            size = size_problem(node, expected, self.scope)
            problem = (size, None) if size is not None else None
        if problem is not None:
            yield CodeProblem(Kind.VALUE, problem[0], self._span(node), problem[1])

    def _span(self, node: ast.expr) -> Span:
        return span_of(node, self.scope.home.source)


def _dimensions(
    node: ast.expr, expected: FieldType, scope: FunctionTypes
) -> tuple[str, str | None] | None:
    """Return why an array of numpy does not fit a field, which takes one dimension only."""
    is_sequence = expected.is_array and expected.array_size is None
    if not is_sequence or not is_number(expected.element):
        return None
    from composer.behavior_checks.operations.array_shapes import (  # noqa: PLC0415 (start-up time)
        rank_of,
    )

    rank = rank_of(node, scope)
    if rank is None or rank <= 1:
        return None
    hint = "write .tobytes()" if expected.name == "uint8" else "write .ravel()"
    return f"an array of {rank} dimensions where {described(expected)} is expected", hint
