"""Checks constants in YAML against the types and the named constants of message fields."""

from __future__ import annotations

from collections.abc import Mapping

from composer.base.diagnostics import shown
from composer.interfaces import INTEGER_RANGES, TEXTS, FieldType, Interfaces, Message
from composer.interfaces.field_types.types import is_seconds
from composer.language.tree import ScalarValue

_LARGEST_FLOAT32 = 3.4028235677973366e38
_LARGEST_SECONDS = 2**31
#: Maximum number of names in a hint.
_SHOWN = 6
#: Words in the names of constants that are limits, not values of a field.
_LIMITS = frozenset({"COUNT", "DEFAULT", "LENGTH", "MAX", "MIN", "NUM", "SIZE", "VERSION"})


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


def enumerator_problem(message: Message, field: str, value: object) -> tuple[str, str] | None:
    """Return that a number is none of the constants for a field, and a hint; None if it may be."""
    if not isinstance(value, int) or isinstance(value, bool):
        return None
    known = enumerators(message, field)
    if not known or value in known.values() or _is_combination(value, set(known.values())):
        return None
    names = [f"{number} {name}" for name, number in known.items()]
    more = ", ..." if len(names) > _SHOWN else ""
    text = f"{message.name} has no constant for '{field}' with the value {value}"
    return text, f"valid here: {', '.join(names[:_SHOWN])}{more}"


def _is_combination(value: int, known: set[int]) -> bool:
    """Return whether the constants are flags and ``value`` is a combination of them."""
    flags = known - {0}
    if not all(flag > 0 and flag.bit_count() == 1 for flag in flags) or max(flags, default=0) < 4:
        return False
    return value & ~sum(flags) == 0
