"""Which types are single numbers, texts and bools of Python."""

from __future__ import annotations

from composer.behavior_types.values import INTEGERS, Value
from composer.field_types import BOOL
from composer.interfaces import FLOATS, TEXTS, FieldType


def is_scalar(type_: Value, names: frozenset[str] | None = None) -> bool:
    """Return whether a type is a single number, text or bool, of one of ``names`` if given."""
    if not isinstance(type_, FieldType) or type_.is_array or not type_.is_primitive:
        return False
    return type_.name != "byte" and (names is None or type_.name in names)


def is_integer(type_: Value) -> bool:
    """Return whether values of a type are ints of Python."""
    return is_scalar(type_, INTEGERS)


def is_float(type_: Value) -> bool:
    """Return whether values of a type are floats of Python."""
    return is_scalar(type_, FLOATS)


def is_number(type_: Value) -> bool:
    """Return whether Python calculates with values of a type, as it does with bools."""
    return is_integer(type_) or is_float(type_) or type_ == BOOL


def is_byte(type_: Value) -> bool:
    """Return whether values of a type are a single byte: bytes of length 1 in Python."""
    return isinstance(type_, FieldType) and not type_.is_array and type_.name == "byte"


def is_text(type_: Value) -> bool:
    """Return whether values of a type are strings of Python."""
    return is_scalar(type_, TEXTS)
