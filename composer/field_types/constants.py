"""Checks constants in YAML against the types of message fields."""

from __future__ import annotations

from composer.diagnostics import shown
from composer.field_types.types import is_seconds
from composer.interfaces import INTEGER_RANGES, TEXTS, FieldType, Interfaces
from composer.tree import ScalarValue

_LARGEST_FLOAT32 = 3.4028235677973366e38
_LARGEST_SECONDS = 2**31


def constant_problem(
    value: ScalarValue, type_: FieldType, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    """Return why ``value`` does not fit a field, and a hint; None if it fits."""
    if type_.is_array:
        return f"{_describe(value)} where {type_} is expected", "write a list: [...]"
    if not type_.is_primitive:
        return _message_problem(value, type_, interfaces)
    if type_.name == "bool":
        fits = isinstance(value, bool)
        return (
            None if fits else (f"{_describe(value)} where bool is expected", "write true or false")
        )
    if type_.name in TEXTS:
        return _string_problem(value, type_)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return f"{_describe(value)} where {type_} is expected", None
    return (
        _integer_problem(value, type_)
        if type_.name in INTEGER_RANGES
        else _float_problem(value, type_)
    )


def _message_problem(
    value: ScalarValue, type_: FieldType, interfaces: Interfaces
) -> tuple[str, str | None] | None:
    if is_seconds(type_) and isinstance(value, int | float) and not isinstance(value, bool):
        fits = -_LARGEST_SECONDS <= value < _LARGEST_SECONDS
        return None if fits else (f"{value} seconds do not fit {type_}", None)
    definition = interfaces.message(type_.name)
    names = ", ".join(definition.field_names) if definition is not None else ""
    hint = f"write a map of its fields: {names}" if names else "write a map of its fields"
    return f"{_describe(value)} where {type_} is expected", hint


def _string_problem(value: ScalarValue, type_: FieldType) -> tuple[str, str | None] | None:
    if not isinstance(value, str):
        hint = f'write it in quotes: "{value}"' if value is not None else None
        return f"{_describe(value)} where {type_} is expected", hint
    if type_.string_bound is not None and len(value) > type_.string_bound:
        return f"a string of {len(value)} characters does not fit {type_}", None
    return None


def _integer_problem(value: int | float, type_: FieldType) -> tuple[str, str | None] | None:
    low, high = INTEGER_RANGES[type_.name]
    if isinstance(value, float):
        hint = f"write {int(value)}" if value.is_integer() else None
        return f"{type_} must be an integer, not {value}", hint
    if not low <= value <= high:
        return f"{value} is outside the range of {type_}", f"allowed: {low} to {high}"
    return None


def _float_problem(value: int | float, type_: FieldType) -> tuple[str, str | None] | None:
    if type_.name == "float32" and abs(value) > _LARGEST_FLOAT32:
        return f"{value} is outside the range of float32", None
    return None


def _describe(value: ScalarValue) -> str:
    match value:
        case None:
            return "null"
        case bool():
            return "true" if value else "false"
        case str():
            return f"the string '{shown(value)}'"
        case _:
            return f"the number {value}"
