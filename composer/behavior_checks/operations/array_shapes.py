"""The shapes of arrays of numpy, as far as their expressions show them."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from composer.behavior_checks.messages.lengths import length_of
from composer.behavior_checks.operations.shapes_of_calls import (
    Shape,
    Side,
    broadcast,
    joined_shapes,
    shape_of_call,
    shape_of_method,
)
from composer.behavior_source import Function
from composer.behavior_source.flow import returned_values
from composer.behavior_source.method_body import is_none
from composer.behavior_source.reaching import reaching_values
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.numpy_names import Generator
from composer.behavior_types.libraries.numpy_types import ARRAY, OF_GENERATORS
from composer.behavior_types.outside_assignments import functions_of
from composer.behavior_types.scalars import is_integer, is_number
from composer.behavior_types.syntax.bindings import bindings_of, nodes_of, reads_attribute
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.syntax.names import value_named
from composer.behavior_types.values import (
    BuiltinObject,
    Collection,
    ModuleFunction,
    OwnMethod,
    OwnObject,
    Self,
    Value,
)
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING
from composer.interfaces import FieldType, Message

_MATRIX = 2


def shape_of(node: ast.expr, scope: FunctionTypes) -> Shape | None:
    """Return the shape of an array, None if it is not known; a number has the shape ().

    The length of a side that is not known is None.
    """
    return _Reader(scope).of(node)


class _Reader:
    """Reads the shapes of the expressions in one function."""

    def __init__(self, scope: FunctionTypes) -> None:
        self._scope = scope

    def of(self, node: ast.expr) -> Shape | None:
        """Return the shape of an expression; one that rests on itself is not known."""
        known = self._scope.shapes
        if id(node) not in known:
            known[id(node)] = None
            known[id(node)] = self._read(node)
        return known[id(node)]

    def _read(self, node: ast.expr) -> Shape | None:
        if self._is_number(node):
            return ()
        found = self._of(node)
        return self._of_list(node) if found is None else found

    def _of(self, node: ast.expr) -> Shape | None:
        match node:
            case ast.Name():
                return self._of_name(node)
            case ast.Attribute(value=value, attr="T"):
                found = self.of(value)
                return found[::-1] if found is not None else None
            case ast.Attribute(value=owner, attr=name):
                return self._of_attribute(self._scope.type_of(owner), name, node)
            case ast.Call():
                return self._of_call(node)
            case ast.BinOp(left=left, op=ast.MatMult(), right=right):
                return product(self.of(left), self.of(right))
            case ast.BinOp(left=left, right=right):
                return self._together(left, right)
            case ast.Compare(left=left, ops=[sign], comparators=[right]):
                is_plain = isinstance(sign, ast.In | ast.NotIn | ast.Is | ast.IsNot)
                return None if is_plain else self._together(left, right)
            case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Invert(), operand=operand):
                return self.of(operand)
            case ast.IfExp(body=first, orelse=second):
                return joined_shapes([self.of(first), self.of(second)])
            case ast.NamedExpr(value=value):
                return self.of(value)
            case ast.Subscript(value=value, slice=index):
                found = self.of(value)
                return self._item(found, index) if found is not None else None
            case ast.List() | ast.Tuple():
                return self._of_display(node)
            case _:
                return None

    # --- names and attributes

    def _of_name(self, node: ast.Name) -> Shape | None:
        """Return the shape of what a name is bound to, if that is the same everywhere."""
        scope, name = self._scope, node.id
        only = scope.bindings.uses.get(id(node))
        if only is not None:
            return self._bound(only.stored)
        if not scope.is_local(name):
            written = value_named(name, scope.home)
            at_module = _Reader(scope.owner.at_module(scope.home))
            return at_module.of(written) if written is not None else None
        if _reshapes(scope) or scope.function is None:
            return None
        values = reaching_values(node, scope.function)
        if values is None:  # in a lambda, or an argument
            values = [item.stored for item in scope.bindings.of_name(name)]
        found = joined_shapes([self._bound(item) for item in values])
        # a number that an array is added to becomes one
        return None if not found and name in scope.bindings.name_changes else found

    def _bound(self, value: ast.expr | None) -> Shape | None:
        return self.of(value) if value is not None else None

    def _of_attribute(self, owner: Value, name: str, node: ast.Attribute) -> Shape | None:
        if isinstance(owner, Message):
            return _of_field(self._scope.type_of(node))
        if not isinstance(owner, Self | OwnObject):
            return None
        places = _places(owner, name, self._scope)
        if _reshapes(self._scope) or any(place.value is None for place in places):
            return None
        shapes = [self._at(place) for place in places if not place.is_computed]
        is_computed = any(place.is_computed for place in places)
        found = joined_shapes(shapes)
        if not found:
            return None  # a number that an array is added to becomes one
        # what is computed from an array at first has as many dimensions
        return (None,) * len(found) if is_computed else found

    @staticmethod
    def _at(place: _Place) -> Shape | None:
        return _Reader(place.scope).of(place.value) if place.value is not None else None

    # --- operations

    def _together(self, left: ast.expr, right: ast.expr) -> Shape | None:
        """Return the shape of an operation on each pair of elements."""
        one, other = self.of(left), self.of(right)
        if one is None or other is None:
            return None
        for item, shape in ((left, other), (right, one)):
            # lists of Python are repeated, joined and compared as a whole, except with arrays
            if isinstance(self._scope.type_of(item), Collection) and not shape:
                return None
        is_list = (isinstance(self._scope.type_of(item), Collection) for item in (left, right))
        return None if all(is_list) else broadcast(one, other)

    def _item(self, whole: Shape, index: ast.expr) -> Shape | None:
        """Return the shape of what an index gives."""
        parts = index.elts if isinstance(index, ast.Tuple) else [index]
        found: list[Side] = []
        sides = list(whole)
        for part in parts:
            if is_new_axis(part, self._scope):
                found.append(1)
                continue
            if not sides:
                return None
            side = sides.pop(0)
            match part:
                case ast.Slice(lower=None, upper=None):
                    found.append(side if part.step is None else None)
                case ast.Slice():
                    found.append(_length(part, side))
                case _ if self._is_number(part):
                    pass
                case _ if _is_tuple(self._scope.type_of(part)):
                    return None  # a name of several indices
                case _:
                    chosen = self.of(part)
                    if chosen is None or len(chosen) != 1 or len(parts) > 1:
                        return None
                    found.append(None)
        return (*found, *sides)

    def _of_display(self, node: ast.List | ast.Tuple) -> Shape | None:
        """Return the shape of nested lists of numbers."""
        if any(isinstance(item, ast.Starred) for item in node.elts) or not node.elts:
            return None
        rows = [self.of(item) for item in node.elts]
        first = rows[0]
        if first is None or any(row != first for row in rows):
            return None
        return (len(rows), *first)

    def _of_list(self, node: ast.expr) -> Shape | None:
        """Return the shape of a list or tuple of numbers, or of tuples of numbers."""
        found = self._scope.type_of(node)
        if not isinstance(found, Collection) or found.python not in (list, tuple, range):
            return None
        least, most = length_of(node, self._scope)
        count = least if least == most else None
        if _is_scalar(found.element):
            return (count,)
        row = found.element
        if isinstance(row, Collection) and row.items and all(map(_is_scalar, row.items)):
            return (count, len(row.items))
        return None

    def _is_number(self, node: ast.expr) -> bool:
        return _is_scalar(self._scope.type_of(node))

    # --- calls

    def _of_call(self, call: ast.Call) -> Shape | None:
        scope = self._scope
        name = scope.called_name(call.func)
        if name.startswith("numpy."):
            return shape_of_call(name.removeprefix("numpy."), call, self.of, self._integer)
        match scope.type_of(call.func):
            case OwnMethod(method=method, home=home) if method.node is not None:
                return self._returned(method.node, scope.owner.scope(method, home))
            case ModuleFunction(node=function, home=home, of=of) as called:
                if called.is_bound and of is None:
                    return None
                return self._returned(function, scope.owner.function(function, home, of))
        if isinstance(call.func, ast.Attribute):
            owner = call.func.value
            if scope.type_of(owner) == BuiltinObject(Generator):
                return self._random(call.func.attr, call)
            found = self.of(owner) if scope.type_of(owner) in (ARRAY, ANYTHING) else None
            if found:
                return shape_of_method(call.func.attr, found, call, self._integer)
        return None

    def _random(self, name: str, call: ast.Call) -> Shape | None:
        sizes = next((item.value for item in call.keywords if item.arg == "size"), None)
        if name not in OF_GENERATORS or sizes is None:
            return None
        items = sizes.elts if isinstance(sizes, ast.Tuple) else [sizes]
        if any(isinstance(item, ast.Starred) for item in items):
            return None
        is_known = isinstance(sizes, ast.Tuple) or self._is_number(sizes)
        return tuple(map(integer_constant, items)) if is_known else None

    def _returned(self, function: Function, inside: FunctionTypes | None) -> Shape | None:
        """Return the shape of what a function of the project returns."""
        if inside is None or function.decorator_list:
            return None
        values = list(returned_values(function))
        reader = _Reader(inside)
        return joined_shapes([reader.of(value) for value in values]) if values else None

    def _integer(self, node: ast.expr) -> int | bool | None:
        """Return the value of an integer, None if it is not known, False for anything else."""
        value = integer_constant(node)
        if value is not None:
            return value
        return None if is_integer(self._scope.type_of(node)) else False


def product(one: Shape | None, other: Shape | None) -> Shape | None:
    """Return the shape of ``one @ other``."""
    if not one or not other or len(other) > _MATRIX:
        return None
    return (*one[:-1], *other[1:])


def rank_of(node: ast.expr, scope: FunctionTypes) -> int | None:
    """Return how many dimensions an array has, None if that is not known."""
    shape = shape_of(node, scope)
    return None if shape is None else len(shape)


def is_array(node: ast.expr, scope: FunctionTypes) -> bool:
    """Return whether an expression is an array of more than one element."""
    if scope.type_of(node) == ARRAY:
        return True
    return scope.type_of(node) is ANYTHING and (rank_of(node, scope) or 0) > 0


def _is_tuple(type_: Value) -> bool:
    return isinstance(type_, Collection) and type_.python is tuple


def is_new_axis(node: ast.expr, scope: FunctionTypes) -> bool:
    """Return whether an index adds a dimension: None, or its name in numpy."""
    return is_none(node) or scope.called_name(node) == "numpy.newaxis"


def _is_scalar(type_: Value) -> bool:
    return type_ is not ANYTHING and is_number(type_)


def _of_field(type_: Value) -> Shape | None:
    """Return the shape that numpy makes of a field of numbers."""
    if isinstance(type_, FieldType) and type_.is_array and is_number(type_.element):
        return (type_.array_size,)
    return () if _is_scalar(type_) else None


def _reshapes(scope: FunctionTypes) -> bool:
    """Return whether a file changes the shapes of arrays in place."""
    text = scope.home.source.text
    return ".shape = " in text or ".resize(" in text


def _length(part: ast.Slice, side: Side) -> Side:
    """Return how many elements a slice has, None if that is not known."""
    given = [item for item in (part.lower, part.upper, part.step) if item is not None]
    if side is None or any(integer_constant(item) is None for item in given):
        return None
    bounds = (
        None if item is None else integer_constant(item)
        for item in (part.lower, part.upper, part.step)
    )
    return len(range(side)[slice(*bounds)])


@dataclass(frozen=True, slots=True)
class _Place:
    """A value of an attribute, and whether it is computed from the old one."""

    value: ast.expr | None
    scope: FunctionTypes
    is_computed: bool


def _places(owner: Self | OwnObject, name: str, scope: FunctionTypes) -> list[_Place]:
    """Return what an attribute of an object is assigned, nothing if other code may do so."""
    types = scope.owner
    if isinstance(owner, Self):
        is_closed = not types.self_escapes and name not in types.set_from_outside
        return [
            _Place(binding.stored, inside, inside.reads_attribute(binding.stored, name))
            for inside, binding in (types.assigned.get(name, ()) if is_closed else ())
        ]
    own = owner.of
    is_alone = len(lineage(own).classes) == 1 and not types.project_classes.derived(own)
    methods = [method.node for method in own.definition.methods if method.node is not None]
    if not is_alone or _sets_outside(name, methods, scope):
        return []
    found: list[_Place] = []
    for function in methods:
        bindings, inside = bindings_of(function), types.function(function, own.home, own)
        for binding in bindings.attributes.get(name, ()):
            is_computed = reads_attribute(binding.stored, bindings.receiver, name)
            found.append(_Place(binding.stored, inside, is_computed))
    return found


def _sets_outside(name: str, methods: Sequence[Function], scope: FunctionTypes) -> bool:
    """Return whether other functions than these methods set an attribute of such a name."""
    for inside, function in functions_of(scope.owner):
        for node in nodes_of(function) if function not in methods else ():
            match node:
                case ast.Attribute(value=owner, attr=attr, ctx=ast.Store()) if attr == name:
                    if not isinstance(inside.type_of(owner), Message | Self):
                        return True
    return False
