"""Constants and lists that do not fit the fields of messages, and wrong indices."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.diagnostics import suggestion
from composer.field_types import constant_problem
from composer.interfaces import INTEGER_RANGES, TEXTS, Field, FieldType, Message
from composer.python_code.checks.scopes import Constant, Scope
from composer.python_code.problems import Family, Problem

#: Maximum number of names in a hint.
_SHOWN = 6
#: Words in the names of constants that are limits, not values of a field.
_LIMITS = frozenset({"COUNT", "DEFAULT", "LENGTH", "MAX", "MIN", "NUM", "SIZE", "VERSION"})


def message_problems(scope: Scope) -> Iterator[Problem]:
    """Yield what is assigned to the fields of messages, or compared with them, and does not fit."""
    for node in scope.nodes:
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    if isinstance(target, ast.Attribute):
                        yield from _field_problems(scope.field(target), value, scope)
                    elif isinstance(target, ast.Subscript):
                        yield from _value_problems(value, scope.type(target), scope)
            case ast.Call(func=function, keywords=keywords):
                message = scope.message_class(function) if keywords else None
                for keyword in keywords if message is not None else ():
                    field = message.field(keyword.arg or "")  # type: ignore[union-attr]
                    found = (message, field) if message and field else None
                    yield from _field_problems(found, keyword.value, scope)
            case ast.Subscript(value=owner, slice=index):
                yield from _index_problem(owner, index, scope)
            case ast.Compare(
                left=left,
                ops=[ast.Eq() | ast.NotEq() | ast.In() | ast.NotIn()],
                comparators=[right],
            ):
                yield from _comparison(left, getattr(right, "elts", [right]), scope)
                yield from _comparison(right, [left], scope)


def _field_problems(
    found: tuple[Message, Field] | None, node: ast.expr, scope: Scope
) -> Iterator[Problem]:
    if found is None:
        return
    problems = list(_value_problems(node, found[1].type, scope))
    yield from problems or _enumerator_problem(*found, node, scope)
    value = scope.constant(node)
    if isinstance(value, str) and value.startswith("/") and found[1].name.endswith("frame_id"):
        message = f"frame ID '{value}' begins with a slash"
        yield scope.problem(Family.FRAME, message, node, "remove the slash")


def _value_problems(node: ast.expr, type_: object, scope: Scope) -> Iterator[Problem]:
    """Yield why an expression does not fit a field or an element of ``type_``."""
    if not isinstance(type_, FieldType):
        return
    if isinstance(node, ast.IfExp):
        for part in (node.body, node.orelse):
            if not isinstance(part, ast.IfExp):  # they may be nested deeply
                yield from _value_problems(part, type_, scope)
    elif type_.is_array:
        yield from _array_problems(node, type_, scope)
    else:
        value = scope.constant(node)
        is_text = isinstance(value, str) and type_.name in TEXTS
        # Values of type byte are bytes in Python.
        is_integer = _is_integer(value) and type_.name in INTEGER_RANGES and type_.name != "byte"
        if is_text or is_integer:
            found = constant_problem(value, type_, scope.code.interfaces)  # type: ignore[arg-type]
            if found is not None:
                yield scope.problem(Family.VALUE, found[0], node, found[1])


def _is_integer(value: Constant) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _array_problems(node: ast.expr, type_: FieldType, scope: Scope) -> Iterator[Problem]:
    count = _length(node, scope)
    size, bound = type_.array_size, type_.array_bound
    if count is not None and (
        (size is not None and count != size) or (bound is not None and count > bound)
    ):
        elements = f"{count} element" + ("" if count == 1 else "s")
        yield scope.problem(Family.VALUE, f"{elements} where {type_} is expected", node)
        return
    for item in node.elts if isinstance(node, ast.List | ast.Tuple) else ():
        problems = list(_value_problems(item, type_.element, scope))
        yield from problems
        if problems:
            return  # the others have the same cause


def _length(node: ast.expr, scope: Scope) -> int | None:
    """Return the number of elements of a list, None if only running the code shows it."""
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items):
            is_open = any(isinstance(item, ast.Starred) for item in items)
            return None if is_open else len(items)
        case ast.BinOp(left=ast.List() as repeated, op=ast.Mult(), right=factor):
            length, times = _length(repeated, scope), scope.constant(factor)
            return length * times if length is not None and isinstance(times, int) else None
    return None


def _index_problem(owner: ast.expr, index: ast.expr, scope: Scope) -> Iterator[Problem]:
    at = scope.constant(index)
    array = scope.type(owner) if isinstance(at, int) else None
    size = array.array_size if isinstance(array, FieldType) else None
    if isinstance(at, int) and size is not None and not -size <= at < size:
        hint = f"indices count from 0, so the last one is {size - 1}"
        yield scope.problem(Family.INDEX, f"{array} has no element {at}", index, hint)


def _comparison(left: ast.expr, others: list[ast.expr], scope: Scope) -> Iterator[Problem]:
    """Yield the values that a field never has, among those that it is compared with."""
    found = scope.field(left) if isinstance(left, ast.Attribute) else None
    if found is None or found[1].type.is_array or not found[1].type.is_primitive:
        return
    type_ = found[1].type
    is_text = type_.name in TEXTS
    for other in others:
        value = scope.constant(other)
        if isinstance(value, str) and not is_text:
            yield scope.doubt(f"{type_} is never equal to a string", other)
        elif isinstance(value, int | float) and (is_text or type_.name == "byte"):
            yield scope.doubt(f"{type_} is never equal to a number", other)
        else:
            yield from _enumerator_problem(*found, other, scope)


def enumerators(message: Message, field: str) -> Mapping[str, int]:
    """Return the constants that are named after the field: STATUS_IDLE for ``status``.

    Without any, they are all constants of the message if only this field has their type.
    """
    numbers = [item for item in message.constants if isinstance(item.value, int)]
    named = [item for item in numbers if item.name.startswith(f"{field.upper()}_")]
    types = {item.type for item in message.constants}
    alike = [item.name for item in message.fields if item.type in types]
    if not named and len(numbers) > 1 and len(types) == 1 and alike == [field]:
        named = numbers
    if any(_LIMITS.intersection(item.name.split("_")) for item in named):
        return {}
    return {item.name: item.value for item in named if isinstance(item.value, int)}


def _enumerator_problem(
    message: Message, field: Field, node: ast.expr, scope: Scope
) -> Iterator[Problem]:
    """Yield why a value is none of the constants for a field."""
    known = enumerators(message, field.name) if not field.type.is_array else {}
    value = scope.constant(node)
    if known and isinstance(value, int) and not isinstance(value, bool):
        if value not in known.values() and not _is_combination(value, set(known.values())):
            names = [f"{number} {name}" for name, number in known.items()]
            more = ", ..." if len(names) > _SHOWN else ""
            text = f"{message.name} has no constant for '{field.name}' with the value {value}"
            hint = f"valid here: {', '.join(names[:_SHOWN])}{more}"
            yield scope.doubt(text, node, hint)
    elif known and isinstance(node, ast.Attribute) and node.attr not in known:
        owner = scope.message_class(node.value)
        if owner is not None and any(item.name == node.attr for item in owner.constants):
            text = f"{owner.name} defines {node.attr} for another field than '{field.name}'"
            yield scope.doubt(text, node, suggestion(node.attr, known))


def _is_combination(value: int, known: set[int]) -> bool:
    """Return whether the constants are flags and ``value`` is a combination of them."""
    flags = known - {0}
    if not all(flag > 0 and flag.bit_count() == 1 for flag in flags) or max(flags, default=0) < 4:
        return False
    return value & ~sum(flags) == 0
