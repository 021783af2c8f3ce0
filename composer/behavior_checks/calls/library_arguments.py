"""Checks the types of what functions of the standard library and of numpy take."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer.behavior_checks.calls.arguments import Signature
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.operations.array_shapes import shape_of
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.scalars import is_float
from composer.behavior_types.values import Collection, Value
from composer.interfaces import FieldType

_JOINING = frozenset({"numpy.concatenate", "numpy.stack"})
#: Parameters of numpy that count: a float fails, also one without a fraction.
_COUNTS = frozenset({"M", "N", "n", "num", "repeats", "shape"})
#: Functions of numpy whose arguments have the same length, and these.
_SAME_LENGTHS: Mapping[str, tuple[str, str]] = {
    "numpy.interp": ("xp", "fp"),
    "numpy.polyfit": ("x", "y"),
}
#: Parameters of the standard library that take a list of Python and nothing else.
_LISTS = frozenset({"heapq.heapify", "heapq.heappop", "heapq.heappush", "heapq.heappushpop"})
#: Functions whose first parameter is a collection, or anything that gives elements.
_SEQUENCES = frozenset(
    {"bisect.bisect", "bisect.bisect_left", "bisect.bisect_right", "bisect.insort"}
    | {"random.choice", "random.choices", "random.sample", "random.shuffle"}
    | {"statistics.fmean", "statistics.mean", "statistics.median", "statistics.pstdev"}
    | {"statistics.stdev", "statistics.variance"}
)


def library_argument_problems(
    call: ast.Call, signature: Signature, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield the first argument of a call that the function does not take."""
    name = signature.name
    given = dict(signature.bound(call))
    for parameter, node in given.items():
        first = parameter == signature.positional[0] if signature.positional else False
        problem = _problem(name, parameter, node, scope, is_first=first)
        if problem is not None:
            message = f"argument '{parameter}' of '{name}': {problem}"
            yield CodeProblem(Kind.CALL, message, span_of(node, scope.home.source))
            return
    one, other = (given.get(item) for item in _SAME_LENGTHS.get(name, ("", "")))
    if one is not None and other is not None:
        shapes = shape_of(one, scope), shape_of(other, scope)
        lengths = [shape[0] if shape else None for shape in shapes]
        if None not in lengths and lengths[0] != lengths[1]:
            message = f"arrays of {lengths[0]} and {lengths[1]} elements in '{name}'"
            yield CodeProblem(Kind.CALL, message, span_of(other, scope.home.source))


def _problem(
    name: str, parameter: str, node: ast.expr, scope: FunctionTypes, *, is_first: bool
) -> str | None:
    found = scope.type_of(node)
    kind = kind_of(found)
    if name.startswith("numpy."):
        if parameter == "dtype" and kind == "number":
            return f"{shown(found)} where a type is expected"
        if parameter == "axis" and name in _JOINING and (found == ARRAY or kind == "collection"):
            return "an array where an axis is expected: put the arrays into one list"
        if parameter in _COUNTS and _is_fraction(found):
            return "a float where an integer is expected"
        return None
    if is_first and name in _LISTS and kind not in (None, "bytes") and not _is_list(found):
        return f"{shown(found)} where a list is expected"
    no_sequence = kind is not None and kind.startswith(("class ", "number", "function"))
    if is_first and name in _SEQUENCES and no_sequence:
        return f"{shown(found)} where a sequence is expected"
    return None


def _is_fraction(found: Value) -> bool:
    parts = found.items if isinstance(found, Collection) and found.items else (found,)
    return any(map(is_float, parts))


def _is_list(found: Value) -> bool:
    is_array = isinstance(found, FieldType) and found.is_array
    return is_array or (isinstance(found, Collection) and found.python is list)
