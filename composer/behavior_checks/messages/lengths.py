"""How many elements a list or a tuple has, as far as its expression shows that."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from typing import TypeAlias

from composer.behavior_checks.guards import OF_LENGTHS, asks_for_length, handles
from composer.behavior_checks.parts import uses_numpy
from composer.behavior_source import Function
from composer.behavior_source.flow import returned_values
from composer.behavior_types.expressions.fillings import fillings_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import has_plain_result
from composer.behavior_types.libraries.numpy_types import ARRAY
from composer.behavior_types.syntax.bindings import How, nodes_of
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.syntax.names import constant_named
from composer.behavior_types.syntax.own_classes import is_enumeration, member_values
from composer.behavior_types.values import (
    BuiltinObject,
    Collection,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    Parameters,
    Self,
)
from composer.field_types import ANYTHING
from composer.interfaces import FieldType, Message
from composer.model import Parameter

#: The least and the most elements; None: there is no limit.
Length: TypeAlias = tuple[int, int | None]
_UNKNOWN: Length = (0, None)
_DEEPEST = 8
_MOST_CASES = 100
#: Functions that give as many elements as they get.
_KEEPING = frozenset({"enumerate", "list", "reversed", "sorted", "tuple"})


def length_of(node: ast.expr, scope: FunctionTypes, depth: int = 0) -> Length:
    """Return how many elements an expression has."""
    found = scope.type_of(node)
    if isinstance(found, Collection) and found.items is not None:
        return _exactly(len(found.items))
    if isinstance(found, FieldType) and found.array_size is not None:
        return _exactly(found.array_size)
    if isinstance(found, OwnClass) and is_enumeration(found):
        members = member_values(found)
        return _exactly(len({ast.unparse(x) for x in members.values()})) if members else _UNKNOWN
    length = _of_syntax(node, scope, depth + 1) if depth < _DEEPEST else _UNKNOWN
    is_array = found in (ARRAY, ANYTHING) or isinstance(node, ast.Attribute)
    if length != _UNKNOWN or not is_array or not uses_numpy(scope.home):
        return length
    return _of_array(node, scope)


def _of_array(node: ast.expr, scope: FunctionTypes) -> Length:
    """Return how many elements an array has in its first dimension, or how many its shape has."""
    from composer.behavior_checks.operations.array_shapes import (  # noqa: PLC0415 (start-up time)
        rank_of,
        shape_of,
    )

    if isinstance(node, ast.Attribute) and node.attr == "shape":
        count = rank_of(node.value, scope)
        return _exactly(count) if count else _UNKNOWN
    is_array = scope.type_of(node) in (ARRAY, ANYTHING)
    shape = shape_of(node, scope) if is_array else None
    return _exactly(shape[0]) if shape and shape[0] is not None else _UNKNOWN


def _of_syntax(node: ast.expr, scope: FunctionTypes, depth: int) -> Length:
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items):
            return _sum(
                length_of(item.value, scope, depth)
                if isinstance(item, ast.Starred)
                else _exactly(1)
                for item in items
            )
        case ast.ListComp(generators=[only]) | ast.GeneratorExp(generators=[only]):
            least, most = length_of(only.iter, scope, depth)
            return (0 if only.ifs else least), most
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _sum(length_of(item, scope, depth) for item in (left, right))
        case ast.BinOp(left=repeated, op=ast.Mult(), right=times):
            count = integer_constant(times)
            least, most = length_of(repeated, scope, depth)
            if count is None:
                return _UNKNOWN
            count = max(count, 0)
            return least * count, None if most is None else most * count
        case ast.Subscript(value=whole, slice=ast.Slice() as part):
            return _sliced(length_of(whole, scope, depth), part)
        case ast.IfExp(body=first, orelse=second):
            return _either(length_of(item, scope, depth) for item in (first, second))
        case ast.Await(value=ast.Call() as call) | (ast.Call() as call):
            return _of_call(call, scope, depth)
        case ast.Name(id=name):
            return _of_name(name, scope, depth)
        case ast.Attribute(value=owner, attr=name) if isinstance(scope.type_of(owner), Self):
            return _of_attribute(name, scope, depth)
        case ast.Attribute(value=owner, attr=name) if isinstance(scope.type_of(owner), Parameters):
            count = parameter_length(scope.owner.node.parameter(name))
            is_asked = scope.function is None or looks_first(scope.function, name, scope)
            is_asked = is_asked or name in scope.owner.refused
            return _UNKNOWN if count is None or is_asked else _exactly(count)
        case _:
            return _UNKNOWN


def _of_call(call: ast.Call, scope: FunctionTypes, depth: int) -> Length:
    called = scope.called_name(call.func)
    match call.func:
        case ast.Attribute(value=array, attr="tolist") if not call.args:
            return length_of(array, scope, depth)
        case ast.Attribute(value=matched, attr="groups") if not call.args:
            return _of_groups(matched, scope)
    if called in _KEEPING and call.args:
        return length_of(call.args[0], scope, depth)
    if called == "range" and len(call.args) == 1:
        count = integer_constant(call.args[0])
        return _UNKNOWN if count is None else _exactly(max(count, 0))
    owner = scope.owner
    match scope.type_of(call.func):
        case OwnMethod(method=method, home=home) if method.node is not None and method.known:
            function, inside = method.node, owner.scope(method, home)
        case ModuleFunction(node=function, home=home, is_bound=is_bound, of=of):
            is_known = (of is not None or not is_bound) and has_plain_result(function)
            inside = owner.function(function, home, of) if is_known else None
        case _:
            return _UNKNOWN
    if inside is None or any(isinstance(node, ast.Yield) for node in nodes_of(function)):
        return _UNKNOWN
    values = list(returned_values(function))
    return _either(length_of(value, inside, depth) for value in values) if values else _UNKNOWN


def _of_groups(owner: ast.expr, scope: FunctionTypes) -> Length:
    """Return how many groups a match has."""
    from composer.behavior_checks.calls.pattern_groups import (  # noqa: PLC0415 (start-up time)
        pattern_of,
    )

    is_match = scope.type_of(owner) == BuiltinObject(re.Match)
    pattern = pattern_of(owner, scope) if is_match else None
    return _UNKNOWN if pattern is None else _exactly(pattern.groups)


def _of_name(name: str, scope: FunctionTypes, depth: int) -> Length:
    if name not in scope.bindings.names:
        constant = None if scope.is_local(name) else constant_named(name, scope.home)
        return length_of(constant, scope, depth) if isinstance(constant, ast.Tuple) else _UNKNOWN
    value = scope.bindings.value_of(name)
    if value is None or scope.function is None:
        return _UNKNOWN
    fillings = fillings_of(scope.function, scope.home)
    is_changed = name in fillings.found or name in fillings.passed_on
    is_changed = is_changed or name in scope.bindings.name_changes
    return _UNKNOWN if is_changed else length_of(value, scope, depth)


def _of_attribute(name: str, scope: FunctionTypes, depth: int) -> Length:
    """Return how many elements an attribute has that is set once, and only read by index."""
    types = scope.owner
    places = types.assigned.get(name, [])
    if len(places) != 1 or types.self_escapes or name in types.set_from_outside:
        return _UNKNOWN
    inside, binding = places[0]
    is_plain = binding.how is How.VALUE and not binding.positions
    if not is_plain or binding.expression is None or inside.function is None:
        return _UNKNOWN
    for other in list(types.scopes.values()):
        if other.function is not None and not _keeps(name, other.function, other):
            return _UNKNOWN
    return length_of(binding.expression, inside, depth)


def _keeps(name: str, function: Function, scope: FunctionTypes) -> bool:
    """Return whether a method leaves the number of elements in ``self.<name>`` as it is."""
    if name in scope.bindings.changes:
        return False
    nodes = nodes_of(function)
    safe = {id(part) for node in nodes for part in _reading(node, scope)}
    return all(
        id(node) in safe
        for node in nodes
        if isinstance(node, ast.Attribute) and node.attr == name and isinstance(node.ctx, ast.Load)
    )


def _reading(node: ast.AST, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield what a node reads without changing how many elements it has."""
    match node:
        case ast.Subscript(value=value, slice=part, ctx=context):
            if isinstance(context, ast.Load) or (
                isinstance(context, ast.Store) and not isinstance(part, ast.Slice)
            ):
                yield value
        case ast.For(iter=iterated) | ast.comprehension(iter=iterated):
            yield iterated
        case ast.Compare(left=left, comparators=others):
            yield from (left, *others)
        case ast.BinOp(left=left, right=right):
            yield from (left, right)
        case ast.Starred(value=value) | ast.Assign(targets=[ast.Tuple() | ast.List()], value=value):
            yield value
        case ast.Assign(targets=[ast.Attribute(value=owner)], value=value):
            if isinstance(scope.type_of(owner), Message):
                yield value
        case ast.Call(func=function, args=arguments, keywords=keywords):
            if scope.called_name(function) in _KEEPING | {"len", "max", "min", "sum", "zip"}:
                yield from arguments
            if isinstance(scope.type_of(function), InterfaceClass):
                yield from (item.value for item in keywords)


def _sliced(whole: Length, part: ast.Slice) -> Length:
    bounds = [
        None if item is None else integer_constant(item)
        for item in (part.lower, part.upper, part.step)
    ]
    given = [item for item in (part.lower, part.upper, part.step) if item is not None]
    if any(integer_constant(item) is None for item in given) or bounds[2] == 0:
        return 0, whole[1]
    places = slice(*bounds)
    if whole[1] is not None and whole[1] - whole[0] < _MOST_CASES:
        counts = [len(range(count)[places]) for count in range(whole[0], whole[1] + 1)]
        return min(counts), max(counts)
    lower, upper, step = bounds
    if step in (None, 1) and upper is not None and upper >= 0 and (lower or 0) >= 0:
        return 0, max(upper - (lower or 0), 0)
    if step in (None, 1) and upper is None and lower is not None and lower < 0:
        return 0, -lower
    return _UNKNOWN


def parameter_length(parameter: Parameter | None) -> int | None:
    """Return how many elements an array parameter has, None if that is not known."""
    value = parameter.value if parameter is not None else None
    return len(value.value) if value is not None and isinstance(value.value, list) else None


def looks_first(function: Function, name: str, scope: FunctionTypes) -> bool:
    """Return whether a function handles missing elements of a parameter, or asks for a length.

    The length of another parameter does not limit this one, unless they have as many elements.
    """
    if handles(function, OF_LENGTHS):
        return True
    return asks_for_length(function, lambda measured: _is_other(measured, name, scope))


def _is_other(measured: ast.expr, name: str, scope: FunctionTypes) -> bool:
    """Return whether an expression is a parameter of another length than that of ``name``."""
    if not isinstance(measured, ast.Attribute):
        return False
    if not isinstance(scope.type_of(measured.value), Parameters):
        return False
    parameter = scope.owner.node.parameter
    count = parameter_length(parameter(measured.attr))
    return count not in (None, parameter_length(parameter(name)))


def _exactly(count: int) -> Length:
    return count, count


def _sum(lengths: Iterable[Length]) -> Length:
    least, most = 0, 0
    is_limited = True
    for length in lengths:
        least += length[0]
        is_limited = is_limited and length[1] is not None
        most += length[1] or 0
    return least, most if is_limited else None


def _either(lengths: Iterable[Length]) -> Length:
    known = list(lengths)
    limits = [most for _, most in known if most is not None]
    is_limited = len(limits) == len(known)
    return min(least for least, _ in known), max(limits) if is_limited else None
