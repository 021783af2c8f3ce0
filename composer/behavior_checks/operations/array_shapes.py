"""The shapes of arrays of numpy that are written down, and operations on others."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from composer.behavior_source import Function
from composer.behavior_source.flow import returned_values
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_names import Generator
from composer.behavior_types.libraries.numpy_types import OF_GENERATORS
from composer.behavior_types.outside_assignments import functions_of
from composer.behavior_types.scalars import is_number
from composer.behavior_types.syntax.bindings import How, bindings_of, nodes_of, reads_attribute
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.syntax.names import value_named
from composer.behavior_types.values import (
    BuiltinObject,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    OwnObject,
    Self,
)
from composer.field_types import ANYTHING
from composer.interfaces import Message

Shape = tuple[int, ...]
_FROM_LISTS = frozenset({"numpy.array", "numpy.asarray"})
_FILLED = frozenset({"numpy.empty", "numpy.full", "numpy.ones", "numpy.zeros"})
_TURNED = frozenset({"numpy.linalg.pinv", "numpy.transpose"})
_SAME = frozenset({"numpy.abs", "numpy.cos", "numpy.linalg.inv", "numpy.sin", "numpy.sqrt"})
_SQUARE = frozenset({"numpy.eye", "numpy.identity"})
_DEEPEST = 6
_MATRIX = 2


def shape_of(node: ast.expr, scope: FunctionTypes, depth: int = _DEEPEST) -> Shape | None:
    """Return the shape of an array, None if it is not known."""
    if depth == 0:
        return None
    match node:
        case ast.Name(id=name):
            return _of_name(name, scope, depth)
        case ast.Attribute(value=value, attr="T"):
            found = shape_of(value, scope, depth - 1)
            return found[::-1] if found is not None else None
        case ast.Call():
            return _of_call(node, scope, depth)
        case ast.BinOp(left=left, op=ast.MatMult(), right=right):
            one, other = shape_of(left, scope, depth - 1), shape_of(right, scope, depth - 1)
            if one is None or other is None or not one or not other:
                return None
            return (*one[:-1], *other[1:]) if len(other) <= _MATRIX else None
        case ast.List() | ast.Tuple():
            return _of_display(node, scope)
        case _:
            return None


def rank_of(node: ast.expr, scope: FunctionTypes, depth: int = _DEEPEST) -> int | None:
    """Return how many dimensions an array has, None if that is not known."""
    shape = shape_of(node, scope, depth)
    if shape is not None or depth == 0:
        return None if shape is None else len(shape)
    match node:
        case ast.Name(id=name):
            value = scope.bindings.value_of(name)
            return None if value is None else rank_of(value, scope, depth - 1)
        case ast.Attribute(value=owner, attr=name):
            object_ = scope.type_of(owner)
            if isinstance(object_, OwnObject):
                return _rank_of_attribute(object_.of, name, scope, depth)
        case ast.Call(func=function, args=[ast.Tuple() as sizes, *_]) if (
            scope.called_name(function) in _FILLED
        ):
            return _count(sizes)
        case ast.Call(func=function, args=[_]) if scope.called_name(function) in _SQUARE:
            return None if any(item.arg != "dtype" for item in node.keywords) else _MATRIX
        case ast.Call(func=ast.Attribute(value=owner, attr=name)) if scope.type_of(
            owner
        ) == BuiltinObject(Generator):
            given = [item.value for item in node.keywords if item.arg == "size"]
            return _count(given[0]) if name in OF_GENERATORS and given else None
        case ast.Call(func=ast.Attribute(value=owner, attr="astype" | "clip" | "copy" | "round")):
            return rank_of(owner, scope, depth - 1)
        case ast.Call(func=function):
            match scope.type_of(function):
                case OwnMethod(method=method, home=home) if method.node is not None:
                    values = list(returned_values(method.node))
                    inside = scope.owner.scope(method, home)
                    if len(values) == 1 and inside is not None:
                        return rank_of(values[0], inside, depth - 1)
    return None


def _rank_of_attribute(own: OwnClass, name: str, scope: FunctionTypes, depth: int) -> int | None:
    """Return the rank that an attribute has at first; what is computed from it has the same."""
    types = scope.owner
    is_alone = len(lineage(own).classes) == 1 and not types.project_classes.derived(own)
    methods = [method.node for method in own.definition.methods if method.node is not None]
    if not is_alone or _sets_outside(name, methods, scope):
        return None
    ranks: set[int | None] = set()
    for method in methods:
        bindings = bindings_of(method)
        for binding in bindings.attributes.get(name, ()):
            inside = types.function(method, own.home, own)
            if binding.how is not How.VALUE or binding.positions or binding.expression is None:
                return None
            if not reads_attribute(binding.expression, bindings.receiver, name):
                ranks.add(rank_of(binding.expression, inside, depth - 1))
    return ranks.pop() if len(ranks) == 1 else None


def _sets_outside(name: str, methods: Sequence[Function], scope: FunctionTypes) -> bool:
    """Return whether other functions than these methods set an attribute of such a name."""
    for inside, function in functions_of(scope.owner):
        for node in nodes_of(function) if function not in methods else ():
            match node:
                case ast.Attribute(value=owner, attr=attr, ctx=ast.Store()) if attr == name:
                    if not isinstance(inside.type_of(owner), Message | Self):
                        return True
    return False


def _count(sizes: ast.expr) -> int | None:
    """Return how many dimensions a tuple of sizes gives."""
    if not isinstance(sizes, ast.Tuple) or any(isinstance(x, ast.Starred) for x in sizes.elts):
        return None
    return len(sizes.elts)


def product_problem(left: ast.expr, right: ast.expr, scope: FunctionTypes) -> str | None:
    """Return why ``left @ right`` fails, None if it may be right."""
    one, other = shape_of(left, scope), shape_of(right, scope)
    if not one or not other or max(len(one), len(other)) > _MATRIX:
        return None
    if one[-1] == other[0]:
        return None
    return f"a product of arrays of shape {_shown(one)} and {_shown(other)}"


def _shown(shape: Shape) -> str:
    return "x".join(map(str, shape))


def _of_name(name: str, scope: FunctionTypes, depth: int) -> Shape | None:
    """Return the shape of what a name is assigned, if that is done once."""
    if not scope.is_local(name):
        written = value_named(name, scope.home)
        at_module = scope.owner.at_module(scope.home)
        return shape_of(written, at_module, depth - 1) if written is not None else None
    value = scope.bindings.value_of(name)
    if value is None or name in scope.bindings.name_changes:
        return None
    return shape_of(value, scope, depth - 1)


def _of_call(call: ast.Call, scope: FunctionTypes, depth: int) -> Shape | None:
    name = scope.called_name(call.func)
    first = call.args[0] if call.args else None
    if isinstance(first, ast.Starred) or any(item.arg == "ndmin" for item in call.keywords):
        return None
    if first is not None and name in _FROM_LISTS:
        return shape_of(first, scope, depth - 1)
    if first is not None and name in _SAME:
        return shape_of(first, scope, depth - 1)
    if first is not None and name in _TURNED and len(call.args) == 1:
        found = shape_of(first, scope, depth - 1)
        return found[::-1] if found is not None else None
    if first is not None and name in _FILLED:
        sizes = first.elts if isinstance(first, ast.Tuple | ast.List) else [first]
        known = [size for size in map(integer_constant, sizes) if size is not None]
        return tuple(known) if len(known) == len(sizes) else None
    if first is not None and name == "numpy.diag" and len(call.args) == 1:
        found = shape_of(first, scope, depth - 1)
        return (*found, *found) if found is not None and len(found) == 1 else None
    if first is not None and name in _SQUARE and len(call.args) == 1:
        size = integer_constant(first)
        has_more = any(item.arg in {"M", None} for item in call.keywords)
        return (size, size) if size is not None and not has_more else None
    return _returned(call, scope, depth)


def _returned(call: ast.Call, scope: FunctionTypes, depth: int) -> Shape | None:
    """Return the shape of what a function of the project returns in its only ``return``."""
    match scope.type_of(call.func):
        case ModuleFunction(node=function, home=home, of=of) as called if not called.is_bound:
            values = list(returned_values(function))
            if len(values) != 1:
                return None
            return shape_of(values[0], scope.owner.function(function, home, of), depth - 1)
        case _:
            return None


def _of_display(node: ast.List | ast.Tuple, scope: FunctionTypes) -> Shape | None:
    """Return the shape of nested lists of numbers."""
    if any(isinstance(item, ast.Starred) for item in node.elts) or not node.elts:
        return None
    if not any(isinstance(item, ast.List | ast.Tuple) for item in node.elts):
        # what is not a number may be an array
        is_known = all(_is_number(item, scope) for item in node.elts)
        return (len(node.elts),) if is_known else None
    rows = [
        _of_display(item, scope) if isinstance(item, ast.List | ast.Tuple) else None
        for item in node.elts
    ]
    first = rows[0]
    if first is None or any(row != first for row in rows):
        return None
    return (len(rows), *first)


def _is_number(node: ast.expr, scope: FunctionTypes) -> bool:
    found = scope.type_of(node)
    return found is not ANYTHING and is_number(found)
