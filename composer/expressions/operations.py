"""Everything a compiled expression can do: each operation checks the types it is given."""

from __future__ import annotations

import math
import operator
from array import array
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Any

from composer.expressions.errors import Refusal

#: The range of integers: what int64 and uint64 fields hold between them.
MAXIMUM_INTEGER = 2**64 - 1
MINIMUM_INTEGER = -(2**63)
_MAXIMUM_DIGITS = 15

_PLAIN_NUMBERS = frozenset((int, float))
_COMPARABLE = frozenset((int, float, bool, str, type(None)))


class Kind(Enum):
    """What a value is, to the language; the value is how an error speaks of it."""

    BOOL = "true or false"
    NUMBER = "a number"
    TEXT = "a text"
    SEQUENCE = "a list"
    MAPPING = "a map"
    MESSAGE = "a message"
    BYTE = "a byte"
    SCALAR = "an element of an array"
    NOTHING = "nothing"
    OTHER = "a value of an unknown kind"


@lru_cache(maxsize=1024)
def kind_of(cls: type) -> Kind:
    """Return what values of ``cls`` are."""
    for base, kind in (
        (bool, Kind.BOOL),
        (int, Kind.NUMBER),
        (float, Kind.NUMBER),
        (str, Kind.TEXT),
        (bytes, Kind.BYTE),
        (list, Kind.SEQUENCE),
        (tuple, Kind.SEQUENCE),
        (array, Kind.SEQUENCE),
        (Mapping, Kind.MAPPING),
        (type(None), Kind.NOTHING),
    ):
        if issubclass(cls, base):
            return kind
    if _is_numpy(cls, "ndarray"):
        return Kind.SEQUENCE
    if _is_numpy(cls, "generic"):
        return Kind.SCALAR
    return Kind.MESSAGE if message_fields(cls) is not None else Kind.OTHER


def _is_numpy(cls: type, name: str) -> bool:
    """Say whether ``cls`` is numpy's, without importing numpy."""
    return any(base.__module__ == "numpy" and base.__name__ == name for base in cls.__mro__)


@lru_cache(maxsize=1024)
def message_fields(cls: type) -> frozenset[str] | None:
    """Return the fields of a generated message class; None for any other class."""
    if not isinstance(getattr(cls, "_fields_and_field_types", None), dict):
        return None
    return frozenset(name for name in cls.get_fields_and_field_types() if name[0] != "_")  # type: ignore[attr-defined]


def plain(value: Any) -> Any:
    """Return a byte as an integer, an element of a numpy array as Python's own, all else as is."""
    if type(value) is bytes and len(value) == 1:
        return value[0]
    return value.item() if kind_of(type(value)) is Kind.SCALAR else value


# -- reading fields


def read_fields(value: Any, names: tuple[str, ...]) -> Any:
    """Return the field that is reached through ``names``."""
    for name in names:
        known = message_fields(type(value))
        if known is not None and name in known:
            value = getattr(value, name)
        else:
            value = _read_key(value, name)
    return plain(value) if type(value) is bytes else value


def read_path(value: Any, parts: tuple[str | int, ...]) -> Any:
    """Return what is reached through field names and list indices."""
    for part in parts:
        value = read_fields(value, (part,)) if isinstance(part, str) else _read_index(value, part)
    return value


def _read_key(value: Any, name: str) -> Any:
    if kind_of(type(value)) is Kind.MAPPING:
        if name in value:
            return value[name]
        raise Refusal(f"there is no '{name}'")
    raise Refusal(f"{_describe(value)} has no field '{name}'")


def _read_index(value: Any, index: int) -> Any:
    if kind_of(type(value)) is not Kind.SEQUENCE:
        raise Refusal(f"{_describe(value)} has no elements")
    if not -len(value) <= index < len(value):
        raise Refusal(f"there is no element {index} in a list of {len(value)}")
    return plain(value[index])


def _describe(value: Any) -> str:
    kind = kind_of(type(value))
    return type(value).__name__ if kind is Kind.MESSAGE else kind.value


# -- calculating


def as_number(value: Any) -> Any:
    """Return ``value`` when it is a number; a truth value is none."""
    if type(value) in _PLAIN_NUMBERS:
        return value
    value = plain(value)
    if kind_of(type(value)) is not Kind.NUMBER:
        raise Refusal(f"{_describe(value)} where a number is expected")
    return value


def bounded(value: Any) -> Any:
    """Return ``value``, refusing integers beyond 64 bits, so that no number grows for ever."""
    if isinstance(value, int) and not MINIMUM_INTEGER <= value <= MAXIMUM_INTEGER:
        raise Refusal("the number is too large")
    return value


def _arithmetic(operate: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def calculate(left: Any, right: Any) -> Any:
        if type(left) not in _PLAIN_NUMBERS or type(right) not in _PLAIN_NUMBERS:
            left, right = as_number(left), as_number(right)
        result = operate(left, right)
        return result if type(result) is float else bounded(result)

    return calculate


def _of_number(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    def calculate(value: Any) -> Any:
        return bounded(function(as_number(value)))

    return calculate


def _of_two_numbers(function: Callable[[float, float], float]) -> Callable[[Any, Any], Any]:
    def calculate(first: Any, second: Any) -> Any:
        return function(as_number(first), as_number(second))

    return calculate


def _extreme(choose: Callable[[Collection[Any]], Any]) -> Callable[..., Any]:
    def calculate(*values: Any) -> Any:
        if len(values) == 1 and kind_of(type(values[0])) is Kind.SEQUENCE:
            values = tuple(values[0])
        if not values:
            raise Refusal("an empty list has neither a smallest nor a largest element")
        return choose([as_number(value) for value in values])

    return calculate


def _round(value: Any, digits: Any = None) -> Any:
    if digits is None:
        return bounded(round(as_number(value)))
    if type(digits) is not int or not 0 <= digits <= _MAXIMUM_DIGITS:
        raise Refusal(f"rounding takes 0 to {_MAXIMUM_DIGITS} digits")
    return round(as_number(value), digits)


def _clamp(value: Any, low: Any, high: Any) -> Any:
    value, low, high = as_number(value), as_number(low), as_number(high)
    if low > high:
        raise Refusal(f"the lower bound {low} is above the upper bound {high}")
    return min(max(value, low), high)


# -- comparing and converting


def comparable(value: Any) -> Any:
    """Return ``value`` when it is a number, a text, a truth value or nothing."""
    if type(value) in _COMPARABLE:
        return value
    value = plain(value)
    if kind_of(type(value)) in (Kind.NUMBER, Kind.TEXT, Kind.BOOL):
        return value
    raise Refusal(f"{_describe(value)} cannot be compared; compare its fields or elements")


def is_in(item: Any, container: Any) -> bool:
    """Say whether ``container``, a list or a text, has ``item`` in it."""
    item = comparable(item)
    kind = kind_of(type(container))
    if kind is Kind.TEXT:
        if not isinstance(item, str):
            raise Refusal(f"{_describe(item)} cannot be part of a text")
        return item in container
    if kind is Kind.SEQUENCE:
        return any(plain(element) == item for element in container)
    raise Refusal(f"{_describe(container)} is neither a list nor a text")


def _length(value: Any) -> int:
    if kind_of(type(value)) not in (Kind.SEQUENCE, Kind.TEXT):
        raise Refusal(f"{_describe(value)} has no length")
    return len(value)


def _to_text(value: Any) -> str:
    return str(comparable(value))


def _to_float(value: Any) -> float:
    return float(_readable(value))


def _to_integer(value: Any) -> int:
    return int(bounded(int(_readable(value))))


def _to_bool(value: Any) -> bool:
    return bool(value if isinstance(value, bool) else as_number(value))


def _readable(value: Any) -> Any:
    value = plain(value)
    if kind_of(type(value)) not in (Kind.NUMBER, Kind.TEXT, Kind.BOOL):
        raise Refusal(f"{_describe(value)} cannot become a number")
    return value


# -- what the compiler knows by name


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the language. ``most`` is None where any number of arguments will do."""

    call: Callable[..., Any]
    least: int = 1
    most: int | None = 1


CONSTANTS: Mapping[str, float | bool] = {"pi": math.pi, "true": True, "false": False}

FUNCTIONS: Mapping[str, Function] = {
    "abs": Function(_of_number(abs)),
    "atan2": Function(_of_two_numbers(math.atan2), 2, 2),
    "bool": Function(_to_bool),
    "ceil": Function(_of_number(math.ceil)),
    "clamp": Function(_clamp, 3, 3),
    "cos": Function(_of_number(math.cos)),
    "degrees": Function(_of_number(math.degrees)),
    "float": Function(_to_float),
    "floor": Function(_of_number(math.floor)),
    "hypot": Function(_of_two_numbers(math.hypot), 2, 2),
    "int": Function(_to_integer),
    "len": Function(_length),
    "max": Function(_extreme(max), 1, None),
    "min": Function(_extreme(min), 1, None),
    "radians": Function(_of_number(math.radians)),
    "round": Function(_round, 1, 2),
    "sin": Function(_of_number(math.sin)),
    "sqrt": Function(_of_number(math.sqrt)),
    "str": Function(_to_text),
    "tan": Function(_of_number(math.tan)),
}

ARITHMETIC: Mapping[str, Callable[..., Any]] = {
    "add": _arithmetic(operator.add),
    "subtract": _arithmetic(operator.sub),
    "multiply": _arithmetic(operator.mul),
    "divide": _arithmetic(operator.truediv),
    "floor_divide": _arithmetic(operator.floordiv),
    "remainder": _arithmetic(operator.mod),
    "negative": _of_number(operator.neg),
    "positive": _of_number(operator.pos),
}
