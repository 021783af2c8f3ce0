"""Parameter values, and whether they fit the declared type and range."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from composer.base.diagnostics import shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.language.tree import Plain
from composer.model import Parameter, ParameterType
from composer.rules.analysis.context import Context, is_unresolved, location

_INTEGERS = (-(2**63), 2**63 - 1)
_BYTES = (0, 255)
_LIMITS = {
    "byte": "0 to 255",
    **dict.fromkeys(("integer", "double"), "the range of signed 64-bit integers"),
}
#: Tolerance for a whole number of steps, in steps.
_TOLERANCE = 1e-6
KNOWN_TYPES = frozenset(kind.value for kind in ParameterType)


def known_values(context: Context) -> Iterator[tuple[Parameter, Located[Plain]]]:
    """Yield every default and every set value of the parameters with a known type.

    So are values in parameter files that name the node, even if the system replaces them.
    In parameter files, ``${`` is plain text.
    """
    files = context.system.parameter_files
    for node in context.system.nodes:
        for parameter in (*node.parameters, *node.overridden_parameters):
            if parameter.type.value not in KNOWN_TYPES:
                continue
            for value in _values(parameter):
                if value.span.file in files or not _is_unresolved_value(value.value):
                    yield parameter, value


def valid_values(context: Context) -> Iterator[tuple[Parameter, Located[Plain]]]:
    """Yield the known values that have the type of their parameter."""
    for parameter, value in known_values(context):
        if type_problem(value.value, parameter.type.value) is None:
            yield parameter, value


def has_wrong_default(parameter: Parameter) -> bool:
    """Return whether the default does not have the declared type: either may be wrong."""
    default, kind = parameter.default, parameter.type.value
    if default is None or kind not in KNOWN_TYPES or _is_unresolved_value(default.value):
        return False
    return type_problem(default.value, kind) is not None


def wrong_choices(parameter: Parameter) -> list[Plain]:
    """Return the choices that do not have the type of their parameter, or of its elements."""
    kind = parameter.type.value.removesuffix("_array")
    if parameter.choices is None or kind not in KNOWN_TYPES:
        return []
    return [choice for choice in parameter.choices.value if type_problem(choice, kind) is not None]


def is_wrong_choice(parameter: Parameter, value: Plain) -> bool:
    """Return whether a value only consists of choices with another type than the declared one."""
    wrong = wrong_choices(parameter)
    items = value if isinstance(value, list) else [value]
    return bool(wrong) and all(item in wrong for item in items)


class ReportedValues:
    """The values that a rule has reported, so that it reports one mistake once.

    A value of a declaration with a wrong default is left out, and so is a value that is given to
    many nodes, such as the number of copies.
    """

    def __init__(self) -> None:
        self._places: set[tuple[str, int, int]] = set()

    def add(self, parameter: Parameter, value: Located[Plain]) -> bool:
        """Return whether to report ``value``, and count it as reported."""
        place, default = location(value.span), parameter.default
        if place in self._places or (default and location(default.span) in self._places):
            return False
        self._places.add(place)
        return True


def _values(parameter: Parameter) -> Iterator[Located[Plain]]:
    if parameter.default is not None:
        yield parameter.default
    if parameter.value is not None and parameter.value is not parameter.default:
        yield parameter.value


def _is_unresolved_value(value: Plain) -> bool:
    items = value if isinstance(value, list) else [value]
    return any(isinstance(item, str) and is_unresolved(item) for item in items)


@dataclass(frozen=True, slots=True)
class RangeProblem:
    """A number outside its range, and the limit that it violates."""

    message: str
    limit: Located[float]


def type_problem(value: Plain, kind: str) -> str | None:
    """Describe ``value`` if it does not have the ParameterType ``kind``; None if it has."""
    element = kind.removesuffix("_array")
    if element == kind:
        return None if _is_element(value, kind) else f"{describe(value)}{_limit(value, kind)}"
    if not isinstance(value, list):
        return describe(value)
    for index, item in enumerate(value):
        if not _is_element(item, element):
            return f"a list with {describe(item)} at index {index}{_limit(item, element)}"
    return None


def _limit(value: Plain, kind: str) -> str:
    """Return the limit that an integer of the type ``kind`` exceeds, as the end of a message."""
    limit = _LIMITS.get(kind)
    if limit is None or not isinstance(value, int) or isinstance(value, bool):
        return ""
    return f", which is outside {limit}"


def range_problem(parameter: Parameter, value: Plain) -> RangeProblem | None:
    """Return the problem of the first number outside the parameter's range, or None."""
    for item in numbers(value):
        problem = _range_problem(parameter, item)
        if problem is not None:
            return problem
    return None


def numbers(value: Plain) -> Iterable[float]:
    """Return the numbers in ``value``: itself, or its elements."""
    items = value if isinstance(value, list) else [value]
    return [item for item in items if _is_number(item)]  # type: ignore[misc]


def describe(value: Plain) -> str:
    """Return a value with its type: ``the string 'fast'``."""
    match value:
        case bool():
            return f"the bool {str(value).lower()}"
        case int():
            return f"the integer {value}"
        case float():
            return f"the double {value!r}"
        case str():
            return f"the string '{shown(value, limit=40)}'"
        case _:
            return "null" if value is None else "a list" if isinstance(value, list) else "a map"


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


def _is_integer(value: Plain, minimum: int, maximum: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and minimum <= value <= maximum


def _is_number(value: Plain) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _range_problem(parameter: Parameter, value: float) -> RangeProblem | None:
    low, high, step = parameter.minimum, parameter.maximum, parameter.step
    unit = f" {parameter.unit}" if parameter.unit else ""
    limit = low or high
    if math.isnan(value) and limit is not None:
        return RangeProblem("the value is not a number, but there are limits", limit)
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
