"""The shapes of what functions of numpy and methods of its arrays return."""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from math import prod
from typing import TypeAlias

from composer.behavior_source.method_body import argument
from composer.behavior_types.syntax.literals import integer_constant

#: The length of a side, None if it is not known.
Side: TypeAlias = "int | None"
Shape: TypeAlias = "tuple[Side, ...]"
_ShapeOf: TypeAlias = "Callable[[ast.expr], Shape | None]"
#: The value of an integer, None if it is not known, False for what may be something else.
_Integer: TypeAlias = "Callable[[ast.expr], int | bool | None]"

_FROM_LISTS = frozenset({"array", "asarray", "ascontiguousarray"})
_FILLED = frozenset({"empty", "full", "ones", "zeros"})
_TURNED = frozenset({"linalg.pinv", "transpose"})
_SAME = frozenset(
    {"abs", "absolute", "argsort", "ceil", "clip", "copy", "cos", "deg2rad"}
    | {"empty_like", "exp", "flip", "floor", "full_like", "isfinite", "isinf", "isnan"}
    | {"linalg.inv", "log", "logical_not", "nan_to_num", "negative", "ones_like", "rad2deg"}
    | {"rint", "roll", "round", "sign", "sin", "sort", "sqrt", "square", "tan", "tanh"}
    | {"zeros_like"}
)
_TOGETHER = frozenset(
    {"add", "arctan2", "divide", "fmod", "hypot", "logical_and", "logical_or", "maximum"}
    | {"minimum", "multiply", "power", "subtract"}
)
_REDUCING = frozenset(
    {"all", "any", "argmax", "argmin", "max", "mean", "median", "min", "prod", "ptp", "std"}
    | {"sum", "var"}
)
_SAME_METHODS = frozenset({"argsort", "astype", "clip", "conj", "copy", "round"})
_FLAT = frozenset({"flatten", "ravel"})
_MATRIX = 2
_CHOICE = 3


def shape_of_call(name: str, call: ast.Call, of: _ShapeOf, integer: _Integer) -> Shape | None:
    """Return the shape of what a function of numpy returns, None if it is not known."""
    if any(isinstance(item, ast.Starred) for item in call.args):
        return None
    if {item.arg for item in call.keywords} & {None, "ndmin", "out", "where"} or not call.args:
        return None
    first = call.args[0]
    if name in _FILLED:
        return _sizes([first], integer)
    if name in {"eye", "identity"}:
        return _square(call, integer)
    if name == "arange":
        count = integer_constant(first) if len(call.args) == 1 else None
        return None if any(map(of, call.args)) else (count,)
    if name == "linspace":
        return _evenly(call, of, integer)
    if name in {"frombuffer", "fromiter", "flatnonzero"}:
        return (None,)
    if name in {"stack", "vstack", "column_stack", "concatenate", "hstack"}:
        return _joined(name, call, of)
    if name == "reshape" and len(call.args) > 1:
        return _reshaped(of(first), call.args[1:], integer)
    found = of(first)
    if name == "where" and len(call.args) == _CHOICE:
        return _together([of(item) for item in call.args])
    if found is None:
        return None
    if name in _FROM_LISTS | _SAME:
        return found if found or name != "clip" else None
    if name in _TURNED and len(call.args) == 1 and not call.keywords:
        return found[::-1]
    if name in _REDUCING:
        return _reduced(found, argument(call, 1, "axis"), call)
    if name == "linalg.norm":
        return _reduced(found, argument(call, 2, "axis"), call)
    if name == "diff":
        return (*found[:-1], None) if found and len(call.args) == 1 and not call.keywords else None
    if name == "diag" and len(call.args) == 1:
        return (*found, *found) if len(found) == 1 else (None,) if len(found) == _MATRIX else None
    if name in {"cumprod", "cumsum"} and argument(call, 1, "axis") is not None:
        return found
    if name == "trace" and len(found) == _MATRIX:
        return ()
    if name in {"ravel", "cumsum"} and len(call.args) == 1 and not call.keywords:
        return (_size(found),)
    if name in {"dot", "matmul", "outer", *_TOGETHER} and len(call.args) == _MATRIX:
        return _of_two(name, found, of(call.args[1]))
    return None


def shape_of_method(name: str, owner: Shape, call: ast.Call, integer: _Integer) -> Shape | None:
    """Return the shape of what a method of an array returns, None if it is not known."""
    if any(isinstance(item, ast.Starred) for item in call.args):
        return None
    if name in _SAME_METHODS:
        return owner
    if name in _FLAT:
        return (_size(owner),)
    if name == "transpose" and not call.args:
        return owner[::-1]
    if name == "reshape":
        return _reshaped(owner, call.args, integer)
    if name in _REDUCING:
        return _reduced(owner, argument(call, 0, "axis"), call)
    return None


def joined_shapes(shapes: Sequence[Shape | None]) -> Shape | None:
    """Return the shape of a value that has one of several shapes, None if their ranks differ."""
    known = [shape for shape in shapes if shape is not None]
    if not known or len(known) < len(shapes) or len({len(shape) for shape in known}) > 1:
        return None
    return tuple(
        sides[0] if all(side == sides[0] for side in sides) else None
        for sides in zip(*known, strict=True)
    )


def broadcast(one: Shape, other: Shape) -> Shape | None:
    """Return the shape of an operation on the elements of two arrays, None if it fails."""
    rank = max(len(one), len(other))
    padded = [(1,) * (rank - len(shape)) + shape for shape in (one, other)]
    found: list[Side] = []
    for first, second in zip(*padded, strict=True):
        if first is None or second is None:
            known = second if first is None else first
            found.append(known if known not in (None, 1) else None)
        elif first != second and 1 not in (first, second):
            return None
        else:
            found.append(max(first, second))
    return tuple(found)


def _together(shapes: Sequence[Shape | None]) -> Shape | None:
    found: Shape | None = ()
    for shape in shapes:
        found = broadcast(found, shape) if found is not None and shape is not None else None
    return found


def _of_two(name: str, one: Shape, other: Shape | None) -> Shape | None:
    if other is None:
        return None
    if name in _TOGETHER:
        return broadcast(one, other)
    if name == "outer":
        return (_size(one), _size(other))
    if not one or not other or len(other) > _MATRIX:
        return None
    return (*one[:-1], *other[1:])


def _size(shape: Shape) -> Side:
    sides = [side for side in shape if side is not None]
    return prod(sides) if len(sides) == len(shape) else None


def _sizes(nodes: Sequence[ast.expr], integer: _Integer) -> Shape | None:
    """Return the shape that integers, or a tuple of them, name."""
    only = nodes[0] if len(nodes) == 1 else None
    items = only.elts if isinstance(only, ast.Tuple | ast.List) else nodes
    is_written = isinstance(only, ast.Tuple | ast.List) or len(nodes) > 1
    if any(isinstance(item, ast.Starred) for item in items):
        return None
    found: list[Side] = []
    for item in items:
        value = integer(item)
        if value is False and not is_written:
            return None  # it may be a tuple
        found.append(None if isinstance(value, bool) else value)
    return tuple(found)


def _square(call: ast.Call, integer: _Integer) -> Shape | None:
    rows = _sizes(call.args[:1], integer)
    columns = argument(call, 1, "M")
    if columns is None or rows is None:
        return (None, None) if rows is None else (*rows, *rows)
    value = integer(columns)
    return (*rows, None if isinstance(value, bool) else value)


def _evenly(call: ast.Call, of: _ShapeOf, integer: _Integer) -> Shape | None:
    """Return the shape of a call of ``linspace``."""
    ends = [argument(call, at, name) for at, name in ((0, "start"), (1, "stop"))]
    if any(item is None or of(item) != () for item in ends):
        return None
    if {item.arg for item in call.keywords} & {"retstep", "axis"}:
        return None
    count = argument(call, 2, "num")
    value = 50 if count is None else integer(count)
    return (None if isinstance(value, bool) else value,)


def _joined(name: str, call: ast.Call, of: _ShapeOf) -> Shape | None:
    """Return the shape of several arrays that are joined."""
    if not isinstance(call.args[0], ast.List | ast.Tuple):
        return None
    found = [of(item) for item in call.args[0].elts]
    shape, count = joined_shapes(found), len(found)
    axis = argument(call, 1, "axis")
    at = 0 if axis is None else integer_constant(axis)
    if shape is None or at is None or not shape:
        return None
    if name == "stack":
        at += len(shape) + 1 if at < 0 else 0
        return (*shape[:at], count, *shape[at:]) if 0 <= at <= len(shape) else None
    if len(shape) == 1 and name in {"vstack", "column_stack"}:
        return (count, *shape) if name == "vstack" else (*shape, count)
    if name in {"column_stack", "hstack"}:
        at = min(1, len(shape) - 1)
    if not -len(shape) <= at < len(shape):
        return None
    sides = list(shape)
    lengths = [item[at] for item in found if item is not None]
    known = [length for length in lengths if length is not None]
    sides[at] = sum(known) if len(known) == len(lengths) else None
    return tuple(sides)


def _reshaped(owner: Shape | None, nodes: Sequence[ast.expr], integer: _Integer) -> Shape | None:
    found = _sizes(nodes, integer) if nodes else None
    if found is None:
        return None
    size = _size(owner) if owner is not None else None
    others = _size(tuple(side for side in found if side != -1))
    if -1 not in found:
        return found if None in (size, others) or size == others else None
    rest = size // others if size is not None and others else None
    return tuple(rest if side == -1 else side for side in found)


def _reduced(owner: Shape, axis: ast.expr | None, call: ast.Call) -> Shape | None:
    if any(item.arg in {"keepdims", None} for item in call.keywords):
        return None
    if axis is None or (isinstance(axis, ast.Constant) and axis.value is None):
        return ()
    at = integer_constant(axis)
    if at is None or not -len(owner) <= at < len(owner):
        return None
    sides = list(owner)
    del sides[at]
    return tuple(sides)
