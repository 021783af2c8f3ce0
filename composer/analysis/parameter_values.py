"""Which values fit a parameter."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from composer.model import Parameter, ParameterType
from composer.source import Located
from composer.tree import Plain

_INTEGERS = (-(2**63), 2**63 - 1)
_BYTES = (0, 255)
#: How far from a whole number of steps a double may be, in steps.
_TOLERANCE = 1e-6

_ELEMENTS = {
    ParameterType.BYTE_ARRAY: "byte",
    ParameterType.BOOL_ARRAY: "bool",
    ParameterType.INTEGER_ARRAY: "integer",
    ParameterType.DOUBLE_ARRAY: "double",
    ParameterType.STRING_ARRAY: "string",
}


@dataclass(frozen=True, slots=True)
class RangeProblem:
    """What is wrong with a number, and the limit that it breaks."""

    message: str
    limit: Located[float]


KNOWN_TYPES = frozenset(kind.value for kind in ParameterType)


def type_problem(value: Plain, kind: str) -> str | None:
    """Return what ``value`` is instead of a ``kind`` (a ParameterType), or None."""
    element = _ELEMENTS.get(ParameterType(kind))
    if element is None:
        return None if _is_element(value, kind) else describe(value)
    if not isinstance(value, list):
        return describe(value)
    for index, item in enumerate(value):
        if not _is_element(item, element):
            return f"a list with {describe(item)} at place {index}"
    return None


def range_problem(parameter: Parameter, value: Plain) -> RangeProblem | None:
    """Return how a number, or one of several, is out of the parameter's range, or None."""
    for item in numbers(value):
        problem = _range_problem(parameter, item)
        if problem is not None:
            return problem
    return None


def numbers(value: Plain) -> Iterable[float]:
    """Return the numbers that ``value`` is or holds."""
    items = value if isinstance(value, list) else [value]
    return [item for item in items if _is_number(item)]  # type: ignore[misc]


def describe(value: Plain) -> str:
    """Return a value with the word for its type: ``the string 'fast'``."""
    match value:
        case bool():
            return f"the bool {str(value).lower()}"
        case int():
            return f"the integer {value}"
        case float():
            return f"the double {value!r}"
        case str():
            return f"the string '{_cut(value)}'"
        case _:
            return "nothing" if value is None else "a list" if isinstance(value, list) else "a map"


def _cut(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


def _is_element(value: Plain, kind: str) -> bool:
    match kind:
        case "bool":
            return isinstance(value, bool)
        case "integer":
            return _is_integer(value, *_INTEGERS)
        case "byte":
            return _is_integer(value, *_BYTES)
        case "double":
            return isinstance(value, float) or _is_integer(value, *_INTEGERS)
        case _:
            return isinstance(value, str)


def _is_integer(value: Plain, least: int, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most


def _is_number(value: Plain) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _range_problem(parameter: Parameter, value: float) -> RangeProblem | None:
    low, high, step = parameter.minimum, parameter.maximum, parameter.step
    unit = f" {parameter.unit}" if parameter.unit else ""
    if low is not None and value < low.value:
        return RangeProblem(f"{value}{unit} is less than the minimum of {low}{unit}", low)
    if high is not None and value > high.value:
        return RangeProblem(f"{value}{unit} is more than the maximum of {high}{unit}", high)
    if step is None or step.value <= 0 or (high is not None and value == high.value):
        return None
    steps = (value - (low.value if low is not None else 0)) / step.value
    if math.isfinite(steps) and abs(steps - round(steps)) > _TOLERANCE:
        start = f" from {low}{unit}" if low is not None else ""
        return RangeProblem(
            f"{value}{unit} is not a whole number of steps of {step}{unit}{start}", step
        )
    return None
