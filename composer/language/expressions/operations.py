"""The operations of compiled expressions. Each one checks its arguments."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Collection, Mapping
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.language.expressions.expression import Kind, Refusal, describe, kind_of, plain

#: The range of integers: int64 and uint64.
MAXIMUM_INTEGER = 2**64 - 1
MINIMUM_INTEGER = -(2**63)
_MAXIMUM_DIGITS = 15

_PLAIN_NUMBERS = frozenset((int, float))
_PLAIN_COMPARABLE = frozenset((int, float, bool, str, type(None)))
_PRIMITIVES = (Kind.NUMBER, Kind.TEXT, Kind.BOOL)
CONSTANTS: Mapping[str, float | bool] = {"pi": math.pi, "true": True, "false": False}


def as_number(value: Any) -> Any:
    """Return ``value`` if it is a number, which excludes booleans."""
    if type(value) in _PLAIN_NUMBERS:
        return value
    value = plain(value)
    if kind_of(type(value)) is not Kind.NUMBER:
        raise Refusal(f"{describe(value)} where a number is expected")
    return value


def bounded(value: Any) -> Any:
    """Return ``value``, but refuse integers beyond 64 bits, to limit their size."""
    if isinstance(value, int) and not MINIMUM_INTEGER <= value <= MAXIMUM_INTEGER:
        raise Refusal("the number is too large")
    return value


def comparable(value: Any) -> Any:
    """Return ``value`` if it is a number, a string, a boolean or None."""
    if type(value) in _PLAIN_COMPARABLE:
        return value
    value = plain(value)
    if kind_of(type(value)) in _PRIMITIVES:
        return value
    raise Refusal(f"{describe(value)} cannot be compared; compare its fields or elements")


def is_in(item: Any, container: Any) -> bool:
    """Return whether ``container``, a list or a string, contains ``item``."""
    item = comparable(item)
    match kind_of(type(container)):
        case Kind.TEXT if isinstance(item, str):
            return item in container
        case Kind.TEXT:
            raise Refusal(f"{describe(item)} cannot be part of a string")
        case Kind.SEQUENCE:
            return any(plain(element) == item for element in container)
        case _:
            raise Refusal(f"{describe(container)} is neither a list nor a string")


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
        raise Refusal("the lower bound is above the upper bound")
    return min(max(value, low), high)


def _length(value: Any) -> int:
    if kind_of(type(value)) not in (Kind.SEQUENCE, Kind.TEXT):
        raise Refusal(f"{describe(value)} has no length")
    return len(value)


def _to_text(value: Any) -> str:
    return str(comparable(value))


def _to_float(value: Any) -> float:
    return float(_primitive(value))


def _to_integer(value: Any) -> int:
    return int(bounded(int(_primitive(value))))


def _to_bool(value: Any) -> bool:
    return value if isinstance(value, bool) else bool(as_number(value))


def _primitive(value: Any) -> Any:
    value = plain(value)
    if kind_of(type(value)) not in _PRIMITIVES:
        raise Refusal(f"{describe(value)} cannot become a number")
    return value


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the language. ``most`` is None for any number of arguments."""

    call: Callable[..., Any]
    least: int = 1
    most: int | None = 1

    @property
    def arguments(self) -> str:
        """The number of arguments in words."""
        if self.most is None:
            return f"at least {self.least} argument"
        if self.least != self.most:
            return f"{self.least} or {self.most} arguments"
        return f"{self.least} argument" + ("s" if self.least > 1 else "")

    def takes(self, count: int) -> bool:
        """Return whether the function takes ``count`` arguments."""
        return self.least <= count and (self.most is None or count <= self.most)


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
