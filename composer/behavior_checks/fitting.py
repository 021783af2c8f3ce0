"""Checks values against the fields and ports that they are for."""

from __future__ import annotations

import ast
from collections import Counter
from inspect import isabstract

from composer.behavior_types.functions import function_name, is_function
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.libraries.standard_types import NO_SEQUENCES
from composer.behavior_types.scalars import is_byte, is_float, is_integer, is_number, is_text
from composer.behavior_types.syntax.own_classes import (
    is_enumeration,
    is_named_tuple,
    is_plain,
)
from composer.behavior_types.values import (
    NONE,
    AnyFunction,
    ApiMethod,
    ApiValue,
    Collection,
    InterfaceClass,
    OwnObject,
    Value,
)
from composer.field_types import (
    BOOL,
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
    is_array = isinstance(expected, FieldType) and expected.is_array
    if isinstance(found, InterfaceClass):
        name = found.definition.name.rpartition("/")[2]
        return f"the class {name} where {_name(expected)} is expected", f"create it: {name}()"
    if found is NONE and isinstance(node, ast.Call) and isinstance(expected, FieldType | Message):
        name = ast.unparse(node.func)
        return f"'{name}' returns nothing, and {_name(expected)} is expected", None
    if is_function(found) and not isinstance(found, ApiMethod):
        name = function_name(found)
        return f"the function '{name}' where {_name(expected)} is expected", f"call it: {name}()"
    is_single = isinstance(expected, Message) or not is_array
    if found == ARRAY and is_single and isinstance(expected, FieldType | Message):
        return f"an array of numpy where {_name(expected)} is expected", None
    if isinstance(found, ApiValue):
        return f"{found.class_name} where {_name(expected)} is expected", None
    if isinstance(found, ApiMethod):
        name = found.member.name
        return f"the method '{name}' where {_name(expected)} is expected", f"call it: {name}()"
    is_tuple = isinstance(found, OwnObject) and is_named_tuple(found.of) and not is_array
    is_enum = isinstance(found, OwnObject) and is_enumeration(found.of)
    is_enum = is_enum and (isinstance(expected, Message) or _is_of_other(kind_of(found), expected))
    if isinstance(found, OwnObject) and (is_plain(found.of) or is_tuple or is_enum):
        return f"a {found.of.definition.name} where {_name(expected)} is expected", None
    if isinstance(found, Collection):
        return _collection_problem(found, expected, interfaces)
    if not isinstance(found, FieldType | Message) or not isinstance(expected, FieldType | Message):
        return None
    if _fits(found, expected, interfaces):
        return None
    hint = _conversion(found, expected)
    return f"{described(found)} where {described(expected)} is expected", hint


def _is_of_other(kind: str | None, expected: Value) -> bool:
    """Return whether a field is for other values than numbers or texts, whichever members are."""
    if not isinstance(expected, FieldType) or kind not in ("number", "text"):
        return False
    is_right = is_number(expected) and expected != BOOL if kind == "number" else is_text(expected)
    return not is_right


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


def _collection_problem(
    found: Collection, expected: Value, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    """Return why a list, dict and so on does not fit a field."""
    if not isinstance(expected, FieldType | Message):
        return None
    if isabstract(found.python):
        is_field = isinstance(expected, FieldType)
        return None if is_field else (f"{shown(found)} where {_name(expected)} is expected", None)
    if isinstance(expected, Message) or not expected.is_array:
        if is_byte(expected) and found.python in (bytes, bytearray):
            return None
        return f"a {found.python.__name__} where {_name(expected)} is expected", None
    if found.python in NO_SEQUENCES:
        hint = None if found.python is dict else "write list(...)"
        return f"a {found.python.__name__} where {described(expected)} is expected", hint
    element = found.element
    kind = kind_of(element)
    if kind is not None and (kind.startswith("class ") or kind == "function"):
        items = f"a {found.python.__name__} of {shown(element)}"
        return f"{items} where {described(expected)} is expected", None
    if not isinstance(element, FieldType | Message) or found.python in (bytes, bytearray):
        return None
    if is_integer(element) and is_float(expected.element):
        return None  # Python converts them
    if not _fits(element, _normal(expected.element, interfaces), interfaces):
        items = f"a {found.python.__name__} of {described(element)}"
        return f"{items} where {described(expected)} is expected", None
    return None


def _normal(type_: FieldType, interfaces: Interfaces) -> FieldType | Message:
    return fields_of(type_, interfaces) or type_


def kind_of(type_: Value) -> str | None:
    """Return the kind of a value, None if it is unknown or has more than one."""
    kind: str | None = None
    if isinstance(type_, Message):
        kind = type_.name
    elif is_number(type_):
        kind = "number"
    elif is_text(type_):
        kind = "text"
    elif is_byte(type_):
        kind = "bytes"
    elif isinstance(type_, Collection):
        kind = _KINDS.get(type_.python, None if isabstract(type_.python) else "collection")
    elif isinstance(type_, FieldType) and type_.is_array:
        kind = None if type_.name in {"byte", "char", "octet", "uint8"} else "collection"
    elif isinstance(type_, AnyFunction) or is_function(type_):
        kind = "function"
    elif isinstance(type_, OwnObject) and is_enumeration(
        type_.of, "enum.IntEnum", "enum.IntFlag", "int"
    ):
        kind = "number"
    elif isinstance(type_, OwnObject) and is_enumeration(type_.of, "enum.StrEnum", "str"):
        kind = "text"
    elif isinstance(type_, OwnObject) and is_named_tuple(type_.of):
        kind = "tuple"
    elif isinstance(type_, OwnObject) and is_plain(type_.of):
        kind = f"class {type_.of.definition.name}"
    return kind


_NUMBERS = ("enum.IntEnum", "enum.IntFlag", "int")
_KINDS: dict[type, str | None] = {
    Counter: "dict",
    dict: "dict",
    bytes: "bytes",
    bytearray: None,
    str: "text",
    range: None,
}


def shown(type_: Value) -> str:
    """Return a type as it is named in messages."""
    if is_function(type_):
        return "a function"
    match type_:
        case Collection(python=python, items=tuple() as items):
            return f"a {python.__name__} of {len(items)}"
        case Collection(python=python):
            return f"a {python.__name__}"
        case OwnObject(of=of):
            return f"a {of.definition.name}"
        case AnyFunction():
            return "a function"
        case FieldType() | Message():
            return described(type_)
        case _:
            return "another value"


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
    if is_byte(expected):
        hint = f"write bytes([{value}])" if type(value) is int else None
        return f"{_a(value)} where a byte is expected", hint
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
    if is_byte(found) or is_byte(expected):
        return is_byte(found) and is_byte(expected)
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


def _is_array(type_: FieldType | Message) -> bool:
    return isinstance(type_, FieldType) and type_.is_array


def _name(type_: Value) -> str:
    return described(type_) if isinstance(type_, FieldType | Message) else "another value"
