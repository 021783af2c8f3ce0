"""Operations, indices and calls that the shapes of arrays of numpy do not allow."""

from __future__ import annotations

import ast
from math import prod

from composer.behavior_checks.operations.array_shapes import shape_of
from composer.behavior_checks.operations.shapes_of_calls import Shape, Side, broadcast
from composer.behavior_source.method_body import argument
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.scalars import is_integer
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.values import Value
from composer.field_types import ANYTHING

_MATRIX = 2
#: The functions of numpy that take an axis of their first argument, by its position.
_WITH_AXIS = {
    **dict.fromkeys(("all", "any", "argmax", "argmin", "max", "mean", "median", "min"), 1),
    **dict.fromkeys(("argsort", "cumsum", "flip", "prod", "sort", "std", "sum", "var"), 1),
    "linalg.norm": 2,
}
_METHODS = frozenset(
    {"all", "any", "argmax", "argmin", "cumsum", "max", "mean", "min", "prod", "std", "sum", "var"}
)


def product_problem(left: ast.expr, right: ast.expr, scope: FunctionTypes) -> str | None:
    """Return why ``left @ right`` fails, None if it may be right."""
    one, other = shape_of(left, scope), shape_of(right, scope)
    if not one or not other or len(other) > _MATRIX:
        return None
    if None in (one[-1], other[0]) or one[-1] == other[0]:
        return None
    return f"a product of arrays of shape {_shown(one)} and {_shown(other)}"


def operation_on_shapes(left: ast.expr, right: ast.expr, scope: FunctionTypes) -> str | None:
    """Return why an operation on each pair of elements fails, None if it may be right."""
    if not any(map(_may_be_array, (scope.type_of(left), scope.type_of(right)))):
        return None
    one, other = shape_of(left, scope), shape_of(right, scope)
    if not one or not other or broadcast(one, other) is not None:
        return None
    return f"an operation on arrays of shape {_shown(one)} and {_shown(other)}"


def index_on_shape(node: ast.Subscript, scope: FunctionTypes) -> tuple[str, ast.expr] | None:
    """Return why an array has no element at an index, and the part that is wrong, or None."""
    if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
        whole, at = shape_of(node.value.value, scope), integer_constant(node.slice)
        if not whole or at is None or -len(whole) <= at < len(whole):
            return None
        return f"an array of {_dimensions(whole)} has no length {at}", node.slice
    whole = shape_of(node.value, scope) if _may_be_array(scope.type_of(node.value)) else None
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    if not whole or not all(_is_place(part, scope) for part in parts):
        return None
    sides = list(whole)
    for part in parts:
        if not sides:
            return f"{len(parts)} indices for an array of {_dimensions(whole)}", node.slice
        side, at = sides.pop(0), integer_constant(part)
        if at is not None and side is not None and not -side <= at < side:
            return f"an array of shape {_shown(whole)} has no index {at} here", part
    return None


def call_on_shapes(call: ast.Call, name: str, scope: FunctionTypes) -> str | None:
    """Return why a call of a function of numpy, or of a method of an array, fails, or None."""
    if not call.args and not name.startswith("."):
        return None
    if any(isinstance(item, ast.Starred) for item in call.args):
        return None
    if name == "numpy.arange":
        sizes = (shape_of(item, scope) for item in call.args)
        is_array = any(size and 1 not in size for size in sizes)
        return "an array where a number is expected" if is_array else None
    if name == "numpy.stack":
        return _stacked(call, scope)
    if isinstance(call.func, ast.Attribute) and name.startswith("."):
        owner, last, shift = call.func.value, name[1:], 1
        is_known = last in _METHODS
    else:
        owner, last, shift = call.args[0], name.removeprefix("numpy."), 0
        is_known = last in _WITH_AXIS
    whole = shape_of(owner, scope) if is_known or last == "reshape" else None
    if not whole:
        return None
    if last == "reshape":
        return _reshaped(whole, call.args[1 - shift :])
    axis = argument(call, _WITH_AXIS.get(last, 1) - shift, "axis")
    at = None if axis is None else integer_constant(axis)
    if at is None or -len(whole) <= at < len(whole):
        return None
    return f"an array of {_dimensions(whole)} has no axis {at}"


def _is_place(node: ast.expr, scope: FunctionTypes) -> bool:
    """Return whether an index is a place or a range of places on one side."""
    return isinstance(node, ast.Slice) or is_integer(scope.type_of(node))


def _stacked(call: ast.Call, scope: FunctionTypes) -> str | None:
    items = call.args[0].elts if isinstance(call.args[0], ast.List | ast.Tuple) else []
    shapes = [shape_of(item, scope) for item in items]
    axis = argument(call, 1, "axis")
    at = None if axis is None else integer_constant(axis)
    first = shapes[0] if shapes else None
    if at is None or not first or -len(first) - 1 <= at <= len(first):
        return None
    return f"arrays of {_dimensions(first)} have no axis {at} when stacked"


def _reshaped(whole: Shape, nodes: list[ast.expr]) -> str | None:
    only = nodes[0] if len(nodes) == 1 else None
    items = only.elts if isinstance(only, ast.Tuple | ast.List) else nodes
    sides = [integer_constant(item) for item in items]
    count, wanted = _size(whole), _size(tuple(side for side in sides if side != -1))
    if count is None or wanted is None or not sides:
        return None
    is_right = count == wanted if -1 not in sides else wanted and count % wanted == 0
    if is_right:
        return None
    return f"{count} elements do not make an array of shape {_shown(tuple(sides))}"


def _size(shape: Shape) -> int | None:
    known = [side for side in shape if side is not None]
    return prod(known) if len(known) == len(shape) else None


def _may_be_array(type_: Value) -> bool:
    return type_ == ARRAY or type_ is ANYTHING


def _dimensions(shape: Shape) -> str:
    return f"{len(shape)} dimension" + ("" if len(shape) == 1 else "s")


def _shown(shape: Shape) -> str:
    def side(length: Side) -> str:
        return "n" if length is None else str(length)

    return "x".join(map(side, shape))
