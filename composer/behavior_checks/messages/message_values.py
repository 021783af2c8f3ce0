"""Checks values against the fields, ports and arrays of messages that they are for."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace

from composer.behavior_checks.fitting import value_problem
from composer.behavior_checks.messages.elements import size_problem
from composer.behavior_checks.messages.field_values import field_problem
from composer.behavior_checks.operations.awaiting import missing_await
from composer.behavior_checks.operations.operations import before_changes
from composer.behavior_checks.parts import possible_values, uses_numpy
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.spans import span_of, start_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.scalars import is_float, is_integer, is_number
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import Pending, Value
from composer.diagnostics import suggestion
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING, BOOL, described
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
        seen: set[str] = set()
        wrong: list[tuple[ast.expr, Field]] = []
        for keyword in node.keywords:
            if keyword.arg is None:
                continue
            field = message.field(keyword.arg)
            if field is not None:
                found = list(self.field(keyword.value, field))
                if found and any(self._fits_in(keyword.value, field, *other) for other in wrong):
                    continue  # two values that are swapped are one slip
                # the same slip in several fields is one, as in ColorRGBA(r=1, g=0, b=0)
                yield from (problem for problem in found if seen.isdisjoint(_slips(problem)))
                seen.update(slip for problem in found for slip in _slips(problem))
                wrong += [(keyword.value, field)] if found else []
            elif keyword.arg != "check_fields":
                problem = f"{message.name} has no field '{keyword.arg}'"
                hint = suggestion(keyword.arg, message.field_names)
                span = start_span(keyword, len(keyword.arg), self.scope.home.source)
                yield CodeProblem(Kind.FIELD, problem, span, hint)
                return  # more of them come from the wrong class

    def _fits_in(self, value: ast.expr, field: Field, other: ast.expr, its_field: Field) -> bool:
        """Return whether two values fit if each is in the field of the other one."""
        return not any(self.field(value, its_field)) and not any(self.field(other, field))

    def added(self, node: ast.Call) -> Iterator[CodeProblem]:
        """Check what ``append`` and ``insert`` add to a list in a message."""
        if isinstance(node.func, ast.Attribute) and node.func.attr in {"append", "insert"}:
            array = self.scope.type_of(node.func.value)
            if isinstance(array, FieldType) and array.is_array and node.args:
                yield from self._element(node.args[-1], array)

    def _element(self, node: ast.expr, array: FieldType) -> Iterator[CodeProblem]:
        """Yield why an expression does not fit the elements of an array; Python converts ints."""
        is_converted = is_float(array.element) and is_integer(self.scope.type_of(node))
        if not is_converted:
            yield from self.value(node, array.element)

    def field(self, node: ast.expr, field: Field) -> Iterator[CodeProblem]:
        """Yield why an expression does not fit a field of a message."""
        problem = field_problem(node, field, self.scope)
        if problem is not None:
            yield problem
        else:
            yield from self.value(node, field.type)

    def value(self, node: ast.expr, expected: Value) -> Iterator[CodeProblem]:
        """Yield why an expression does not fit ``expected``."""
        parts = list(possible_values(node, self.scope))
        wrong = [found for part in parts if (found := list(self._part(part, expected)))]
        first = wrong[0] if wrong else []
        if isinstance(node, ast.Name) and len(wrong) == len(parts) > 1:
            # no choice of the value fits, so that the name is the wrong one
            first = [replace(problem, span=self._span(node)) for problem in first]
        yield from first  # the other parts have the same cause

    def _part(self, node: ast.expr, expected: Value) -> Iterator[CodeProblem]:
        found = self.scope.type_of(node)
        if isinstance(found, Pending):
            yield missing_await(found, self.function, self.scope)
            return
        display = _repeated(node)
        if isinstance(display, ast.List | ast.Tuple) and isinstance(expected, FieldType):
            is_checked = expected.is_array and expected.name != "byte"
            items = [item for item in display.elts if not isinstance(item, ast.Starred)]
            items = items if is_checked else []
            wrong = (problem for item in items for problem in self._element(item, expected))
            first = next(wrong, None)  # the others have the same cause
            if first is not None:
                yield first
                return
        if found is ANYTHING and _is_message(expected):
            before = before_changes(node, self.scope)  # what is added to a number makes no message
            found = before if is_number(before) else found
        problem = value_problem(node, found, expected, self.scope.owner.interfaces)
        if problem is None and expected == BOOL and "numpy" in self.scope.home.source.text:
            problem = _of_numpy(node, self.scope)
        if problem is None and isinstance(expected, FieldType):
            problem = _dimensions(node, expected, self.scope)
        if problem is None and isinstance(expected, FieldType):
            size = size_problem(node, expected, self.scope)
            problem = (size, None) if size is not None else None
        if problem is not None:
            place = self._creation(node) if _are_parts(found, expected) else node
            yield CodeProblem(Kind.VALUE, problem[0], self._span(place), problem[1])

    def _creation(self, node: ast.expr) -> ast.expr:
        """Return where a message is created that a name means, if that is known."""
        value = self.scope.bindings.value_of(node.id) if isinstance(node, ast.Name) else None
        if not isinstance(value, ast.Call) or not isinstance(node, ast.Name):
            return node
        passed = [
            item
            for use in nodes_of(self.function)
            for item in _passed(use)
            if isinstance(item, ast.Name) and item.id == node.id and item is not node
        ]
        return node if passed else value.func  # it may be right for what else gets it

    def _span(self, node: ast.expr) -> Span:
        return span_of(node, self.scope.home.source)


def _passed(node: ast.AST) -> list[ast.expr]:
    """Return what a call takes or a statement returns."""
    match node:
        case ast.Call(args=arguments):
            return arguments
        case ast.Return(value=ast.expr() as value):
            return [value]
        case _:
            return []


def _is_message(expected: Value) -> bool:
    """Return whether a field or a port is for one message."""
    if isinstance(expected, FieldType):
        return not expected.is_array and not expected.is_primitive
    return isinstance(expected, Message)


def _slips(problem: CodeProblem) -> Iterator[str]:
    """Yield what equal slips in two fields have in common: the message, or the conversion."""
    yield problem.message
    if problem.hint is not None and " where " in problem.message:
        yield f"{problem.message.partition(' where ')[0]}: {problem.hint}"


def _are_parts(found: Value, expected: Value) -> bool:
    """Return whether two messages are of the same service or action, as request and response."""
    names = [item.name if isinstance(item, Message) else "" for item in (found, expected)]
    homes = [name.rpartition("_")[0] for name in names]
    return homes[0] == homes[1] and ("/srv/" in homes[0] or "/action/" in homes[0])


def _repeated(node: ast.expr) -> ast.expr:
    """Return the list in an expression such as ``[0.0] * 3``, or else the expression."""
    match node:
        case ast.BinOp(left=ast.List() as display, op=ast.Mult()):
            return display
        case ast.BinOp(op=ast.Mult(), right=ast.List() as display):
            return display
        case _:
            return node


def _of_numpy(node: ast.expr, scope: FunctionTypes) -> tuple[str, str | None] | None:
    from composer.behavior_checks.messages.numpy_values import (  # noqa: PLC0415 (start-up time)
        numpy_problem,
    )

    return numpy_problem(node, scope)


def _dimensions(
    node: ast.expr, expected: FieldType, scope: FunctionTypes
) -> tuple[str, str | None] | None:
    """Return why an array of numpy does not fit a field, which takes one dimension only.

    In a field of a fixed size, ROS reads memory beyond the first dimension.
    """
    if not expected.is_array or not is_number(expected.element):
        return None
    is_list = isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "tolist"
    if is_list and isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        node = node.func.value
    if scope.type_of(node) not in (ARRAY, ANYTHING) or not uses_numpy(scope.home):
        return None
    from composer.behavior_checks.operations.array_shapes import (  # noqa: PLC0415 (start-up time)
        rank_of,
    )

    rank = rank_of(node, scope)
    if rank is None or rank <= 1:
        return None
    hint = "write .tobytes()" if expected.name == "uint8" else "write .ravel()"
    hint += " before it" if is_list else ""
    return f"an array of {rank} dimensions where {described(expected)} is expected", hint
