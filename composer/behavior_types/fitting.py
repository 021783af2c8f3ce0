"""Checks values against the fields and ports that they are for."""

from __future__ import annotations

import ast

from composer.behavior_types.values import (
    ApiValue,
    InterfaceClass,
    ModuleFunction,
    OwnMethod,
    Value,
)
from composer.field_types import (
    BOOL,
    FieldChecker,
    constant_problem,
    described,
    fields_of,
)
from composer.interfaces import FLOATS, INTEGER_RANGES, FieldType, Interfaces, Message

_NUMBERS = frozenset((*INTEGER_RANGES, *FLOATS))


def value_problem(
    node: ast.expr, found: Value, expected: Value, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    """Return why an expression of type ``found`` does not fit, and a hint; None if it may fit."""
    constant = _constant(node)
    if constant is not None and isinstance(expected, FieldType):
        return _constant_problem(constant, expected, interfaces)
    if isinstance(found, InterfaceClass):
        name = found.definition.name.rpartition("/")[2]
        return f"the class {name} where {_name(expected)} is expected", f"create it: {name}()"
    if isinstance(found, OwnMethod | ModuleFunction):
        name = found.method.name if isinstance(found, OwnMethod) else found.node.name
        return f"the function '{name}' where {_name(expected)} is expected", f"call it: {name}()"
    if isinstance(found, ApiValue):
        return f"{found.class_name} where {_name(expected)} is expected", None
    if not isinstance(found, FieldType | Message) or not isinstance(expected, FieldType | Message):
        return None
    if _fits(found, expected, interfaces):
        return None
    return f"{described(found)} where {described(expected)} is expected", None


def _constant(node: ast.expr) -> bool | int | float | str | None:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _constant(node.operand)
        return -value if isinstance(value, int | float) and not isinstance(value, bool) else None
    if isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float | str):
        return node.value
    return None


def _constant_problem(
    value: bool | int | float | str, expected: FieldType, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    if expected.is_array or expected.name == "byte" or not expected.is_primitive:
        # A string or bytes may fill an array, and messages have their own reasons.
        if expected.is_primitive or expected.is_array:
            return None
        return f"a {type(value).__name__} where {described(expected)} is expected", None
    if isinstance(value, bool) and expected.name in _NUMBERS:
        return None  # in Python, a bool is a number
    problem = constant_problem(value, expected, interfaces)
    return (problem[0], None) if problem is not None else None


def _fits(
    found: FieldType | Message, expected: FieldType | Message, interfaces: Interfaces
) -> bool:
    if found == BOOL or _is_opaque(found) or _is_opaque(expected):
        return found != BOOL or not (isinstance(expected, Message) or _is_text(expected))
    if fields_of(found, interfaces) is None and not isinstance(found, FieldType):
        return True
    if isinstance(expected, FieldType) and not expected.is_array and not expected.is_primitive:
        message = fields_of(expected, interfaces)
        actual = fields_of(found, interfaces)
        return message is None or (actual is not None and actual.name == message.name)
    return FieldChecker(interfaces, {}).fits(found, expected)


def _is_opaque(type_: FieldType | Message) -> bool:
    """Return whether Python has several types for the values: bytes, arrays."""
    return isinstance(type_, FieldType) and (type_.is_array or type_.name == "byte")


def _is_text(type_: FieldType | Message) -> bool:
    return isinstance(type_, FieldType) and not type_.is_array and type_.name == "string"


def _name(type_: Value) -> str:
    return described(type_) if isinstance(type_, FieldType | Message) else "another value"
