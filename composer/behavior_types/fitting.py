"""Checks values against the fields and ports that they are for."""

from __future__ import annotations

import ast

from composer.behavior_types.operators import is_float, is_integer, is_number, is_text
from composer.behavior_types.values import (
    ApiMethod,
    ApiValue,
    Collection,
    InterfaceClass,
    ModuleFunction,
    OwnMethod,
    Value,
)
from composer.field_types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STRING,
    FieldChecker,
    constant_problem,
    described,
    fields_of,
)
from composer.interfaces import FieldType, Interfaces, Message

#: Ints from here on are not shown.
_LARGE = 10**15


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
    if isinstance(found, ApiMethod):
        name = found.member.name
        return f"the method '{name}' where {_name(expected)} is expected", f"call it: {name}()"
    if isinstance(found, Collection):
        return _collection_problem(found, expected)
    if not isinstance(found, FieldType | Message) or not isinstance(expected, FieldType | Message):
        return None
    if _fits(found, expected, interfaces):
        return None
    hint = _conversion(found, expected)
    return f"{described(found)} where {described(expected)} is expected", hint


def _conversion(found: Value, expected: FieldType | Message) -> str | None:
    """Return how to convert a number; ROS sends wrong values for what is not converted."""
    if is_float(expected) and is_number(found):
        return "write float(...); ROS does not convert it"
    if expected == BOOL and is_number(found):
        return "write bool(...); ROS does not convert it"
    return (
        "write int(...); ROS does not convert it"
        if is_integer(expected) and is_number(found)
        else None
    )


def _collection_problem(found: Collection, expected: Value) -> tuple[str, str | None] | None:
    """Return why a list, dict and so on does not fit a field."""
    if isinstance(expected, Message) or (isinstance(expected, FieldType) and not expected.is_array):
        if isinstance(expected, FieldType) and expected.name == "byte":
            return None
        return f"a {found.python.__name__} where {_name(expected)} is expected", None
    if not isinstance(expected, FieldType):
        return None
    if found.python is dict:
        return f"a dict where {described(expected)} is expected", None
    return None


def argument_problem(node: ast.expr, found: Value, expected: Value) -> str | None:
    """Return why an argument contradicts the annotation of its parameter, None if it may fit.

    Numbers fit numbers and bools, as they do in Python.
    """
    kind, wanted = _kind(found), _kind(expected)
    if isinstance(expected, Collection) and isinstance(node, ast.List | ast.Tuple):
        for item in node.elts:
            constant = _constant(item)
            element = _constant_type(constant) if constant is not None else ANYTHING
            if argument_problem(item, element, expected.element) is not None:
                return f"{_shown(element)} where {_shown(expected.element)} is expected"
    if kind is None or wanted is None or kind == wanted:
        return None
    return f"{_shown(found)} where {_shown(expected)} is expected"


def _kind(type_: Value) -> str | None:
    """Return the kind of a value, None if it is unknown or has more than one."""
    if isinstance(type_, Message):
        return type_.name
    if is_number(type_):
        return "number"
    if is_text(type_):
        return "text"
    if isinstance(type_, Collection):
        return "dict" if type_.python is dict else "collection"
    return "collection" if isinstance(type_, FieldType) and type_.is_array else None


def _shown(type_: Value) -> str:
    if isinstance(type_, Collection):
        return f"a {type_.python.__name__}"
    return described(type_) if isinstance(type_, FieldType | Message) else "another value"


def _constant_type(value: bool | int | float | str) -> Value:
    if isinstance(value, bool):
        return BOOL
    if isinstance(value, str):
        return STRING
    return NUMBER if isinstance(value, float) else INTEGER


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
    if expected.name == "byte" and not expected.is_array:
        return None
    if expected.is_array or not expected.is_primitive:
        return f"{_a(value)} where {described(expected)} is expected", None
    if isinstance(value, int) and is_float(expected):
        # ROS does not convert it: it sends another number.
        hint = f"write {int(value)}.0; ROS does not convert it" if abs(value) < _LARGE else None
        return f"{_a(value)} where {described(expected)} is expected", hint
    if isinstance(value, bool) and is_integer(expected):
        return None  # in Python, a bool is an int
    problem = constant_problem(value, expected, interfaces)
    return (problem[0], None) if problem is not None else None


def _a(value: bool | int | float | str) -> str:
    return "an int" if type(value) is int else f"a {type(value).__name__}"


def _fits(
    found: FieldType | Message, expected: FieldType | Message, interfaces: Interfaces
) -> bool:
    if _is_bytes(found) or _is_bytes(expected):
        return True
    if _is_array(found) or _is_array(expected):
        return _is_array(found) and _is_array(expected)
    if is_number(found) and isinstance(expected, FieldType) and expected.is_primitive:
        return _fits_number(found, expected)
    if fields_of(found, interfaces) is None and not isinstance(found, FieldType):
        return True
    if isinstance(expected, FieldType) and not expected.is_array and not expected.is_primitive:
        message = fields_of(expected, interfaces)
        actual = fields_of(found, interfaces)
        return message is None or (actual is not None and actual.name == message.name)
    return FieldChecker(interfaces, {}).fits(found, expected)


def _fits_number(found: FieldType | Message, expected: FieldType) -> bool:
    """Return whether ROS accepts a number or a bool in a field; it converts none of them."""
    if is_float(expected):
        return is_float(found)
    if expected == BOOL:
        return found == BOOL
    return is_integer(expected) and not is_float(found)


def _is_bytes(type_: FieldType | Message) -> bool:
    return isinstance(type_, FieldType) and not type_.is_array and type_.name == "byte"


def _is_array(type_: FieldType | Message) -> bool:
    return isinstance(type_, FieldType) and type_.is_array


def _name(type_: Value) -> str:
    return described(type_) if isinstance(type_, FieldType | Message) else "another value"
