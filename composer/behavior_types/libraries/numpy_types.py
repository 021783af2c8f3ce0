"""The types of arrays of numpy: what its functions and their methods return."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence

from composer.behavior_types.libraries.numpy_names import Generator, ndarray
from composer.behavior_types.values import BuiltinObject, Collection, Value
from composer.field_types import ANYTHING, INTEGER

ARRAY = BuiltinObject(ndarray)
_CREATING = frozenset(
    {"arange", "argwhere", "array", "asarray", "ascontiguousarray", "column_stack", "concatenate"}
    | {"convolve", "correlate", "cumprod", "cumsum", "diag", "diff", "dstack", "empty"}
    | {"empty_like", "eye", "fft.fft", "fft.fftfreq", "fft.ifft", "fft.irfft", "fft.rfft"}
    | {"fft.rfftfreq", "flatnonzero", "flip", "frombuffer", "full", "full_like", "hstack"}
    | {"identity", "linalg.inv", "linalg.pinv", "linspace", "logspace", "ones", "ones_like"}
    | {"outer", "repeat", "roll", "sort", "stack", "tile", "unwrap", "vstack", "zeros"}
    | {"zeros_like"}
)
#: Functions that give an array for an array, and a number for a number.
_ELEMENTWISE = frozenset(
    {"abs", "absolute", "arccos", "arcsin", "arctan", "arctan2", "ceil", "clip", "cos", "deg2rad"}
    | {"degrees", "exp", "floor", "fmod", "hypot", "interp", "isfinite", "isinf", "isnan", "log"}
    | {"log10", "log2", "logical_and", "logical_not", "logical_or", "maximum", "minimum", "mod"}
    | {"nan_to_num", "power", "rad2deg", "radians", "round", "sign", "sin", "sqrt", "square"}
    | {"tan", "tanh"}
)
_METHODS = frozenset(
    {"astype", "clip", "copy", "cumsum", "flatten", "ravel", "reshape", "round", "swapaxes"}
    | {"transpose"}
)
OF_GENERATORS = frozenset({"integers", "normal", "random", "uniform"})
_ATTRIBUTES: Mapping[str, Value] = {
    "T": ARRAY,
    "nbytes": INTEGER,
    "ndim": INTEGER,
    "shape": Collection(tuple, INTEGER),
    "size": INTEGER,
}


def numpy_result(name: str, arguments: Sequence[Value], keywords: Mapping[str, Value]) -> Value:
    """Return the type of a call of a function of numpy."""
    if name == "random.default_rng":
        return BuiltinObject(Generator)
    if name in _CREATING:
        return ARRAY
    has_choice = name == "where" and len(arguments) + len(keywords) > 1
    if name in _ELEMENTWISE or has_choice:
        return ARRAY if ARRAY in (*arguments, *keywords.values()) else ANYTHING
    return ANYTHING


def numpy_class(full: str) -> Value:
    """Return the type of an object of a class of numpy that an annotation names."""
    return ARRAY if full == "numpy.ndarray" else ANYTHING


def array_attribute(name: str) -> Value | None:
    """Return the type of an attribute of an array that is not a method, None for others."""
    return _ATTRIBUTES.get(name)


def numpy_method_result(python: type, name: str, keywords: Mapping[str, Value]) -> Value | None:
    """Return the type of what a method of an array or of a generator returns, None for others."""
    if python is ndarray:
        if name == "tobytes":
            return Collection(bytes, INTEGER)
        if name == "tolist":
            return Collection(list)
        return ARRAY if name in _METHODS else ANYTHING
    if python is Generator:
        return ARRAY if name in OF_GENERATORS and "size" in keywords else ANYTHING
    return None


def array_comparison(operands: Sequence[Value]) -> Value:
    """Return the type of a comparison: an array if an operand is one and all are known."""
    is_known = ARRAY in operands and ANYTHING not in operands
    is_plain = all(not isinstance(item, BuiltinObject) or item == ARRAY for item in operands)
    return ARRAY if is_known and is_plain else ANYTHING


def array_operation(left: Value, operator: ast.operator, right: Value) -> Value | None:
    """Return the type of an operation with an array, None without one."""
    if ARRAY not in (left, right):
        return None
    is_known = ANYTHING not in (left, right) and not isinstance(operator, ast.MatMult)
    is_plain = all(not isinstance(item, BuiltinObject) or item == ARRAY for item in (left, right))
    return ARRAY if is_known and is_plain else ANYTHING
