"""Finds attributes of a behavior that get values of different kinds."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.operations.operations import uncalled
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.bindings import Binding, How, nodes_of
from composer.behavior_types.values import InterfaceClass, OwnClass, OwnObject, Pending, Value
from composer.field_types import BOOL
from composer.interfaces import Message

#: Where attributes are usually set first.
_FIRST = ("__init__", "on_configure", "on_activate")


def changing_attributes(types: BehaviorTypes) -> Iterator[CodeProblem]:
    """Yield the values that are of another kind than what the attribute is set to at first.

    An annotation allows what it says. Objects of several classes, and messages of several types,
    may well take turns.
    """
    yield from _without_await(types)
    yield from _without_call(types)
    for name, bindings in types.assigned.items():
        if any(binding.how is How.ANNOTATION for _, binding in bindings):
            continue
        known = [(*place, type_) for place in bindings if (type_ := _type(place)) is not None]
        known.sort(key=lambda item: not _is_first(types, item[0]))
        for scope, binding, type_ in known[1:]:
            first = known[0][2]
            value = binding.expression
            other = _differ(first, type_) and not _may_change(types, name, first)
            if value is not None and _is_calculated(value, scope):
                continue  # it is reported where the name is set
            if value is not None and (other or _lacks_field(types, name, first, type_)):
                message = f"attribute '{name}': {shown(type_)} where it is {shown(first)} at first"
                span = span_of(value, scope.home.source)
                hint = f"annotate it where it is set first, as in 'self.{name}: type'"
                yield CodeProblem(Kind.CHANGED, message, span, hint)


def _without_await(types: BehaviorTypes) -> Iterator[CodeProblem]:
    """Yield the asynchronous calls that are stored in an attribute of another kind."""
    for places in types.assigned.values():
        kinds = {
            kind_of(scope.bound(binding))
            for scope, binding in places
            if binding.expression is not None
        }
        for scope, binding in places:
            found = scope.bound(binding) if binding.expression is not None else None
            if isinstance(found, Pending) and kinds - {None}:
                message = f"'{found.name}' is asynchronous and is not awaited"
                span = span_of(found.call.func, scope.home.source)
                yield CodeProblem(Kind.AWAIT, message, span, "write 'await' before it")


def _is_calculated(value: ast.expr, scope: FunctionTypes) -> bool:
    """Return whether a name means a method without its call, and is calculated with as well."""
    return (
        isinstance(value, ast.Name)
        and scope.function is not None
        and uncalled(value, scope) is not None
        and any(
            isinstance(item, ast.Name) and item.id == value.id
            for node in nodes_of(scope.function)
            if isinstance(node, ast.BinOp)
            for item in (node.left, node.right)
        )
    )


def _without_call(types: BehaviorTypes) -> Iterator[CodeProblem]:
    """Yield the classes that are stored in an attribute which also gets an object of the class."""
    for places in types.assigned.values():
        values = [(*place, _bound(place)) for place in places]
        objects = [found.of for _, _, found in values if isinstance(found, OwnObject)]
        for scope, binding, found in values:
            if isinstance(found, OwnClass) and found in objects and binding.expression is not None:
                name = found.definition.name
                span = span_of(binding.expression, scope.home.source)
                message = f"this is the class {name}, not an object of it"
                yield CodeProblem(Kind.CHANGED, message, span, f"create one: {name}()")
        kinds = {kind_of(found) for _, _, found in values if found is not None}
        for scope, binding, found in values:
            value = binding.expression
            if isinstance(found, InterfaceClass) and value is not None and kinds - {None, "text"}:
                name = found.definition.name.rpartition("/")[2]
                span = span_of(value, scope.home.source)
                message = f"this is the class {name}, and other values are not"
                yield CodeProblem(Kind.CHANGED, message, span, f"did you mean {name}()?")


def _bound(place: tuple[FunctionTypes, Binding]) -> Value | None:
    scope, binding = place
    return scope.bound(binding) if binding.expression is not None else None


def _type(place: tuple[FunctionTypes, Binding]) -> Value | None:
    found = _bound(place)
    if isinstance(found, OwnObject) and is_rclpy(found.of.home):
        return None  # a parameter, then its value
    return found if found is not None and kind_of(found) is not None else None


def _is_first(types: BehaviorTypes, scope: FunctionTypes) -> bool:
    return any(scope is types.scopes.get(id(method)) for method in _first_methods(types))


def _first_methods(types: BehaviorTypes) -> Iterator[ast.AST]:
    for _, known in types.source.classes:
        for method in known.methods:
            if method.name in _FIRST and method.node is not None:
                yield method.node


def _differ(first: Value, second: Value) -> bool:
    kinds = kind_of(first), kind_of(second)
    if kinds[0] == kinds[1] or "bytes" in kinds:
        return False
    is_several = (Message, OwnObject)
    if isinstance(first, is_several) and isinstance(second, is_several):
        return False
    # Text takes the place of many things: of a number that is not known, or of an error.
    return "text" not in kinds or any(isinstance(item, is_several) for item in (first, second))


def _lacks_field(types: BehaviorTypes, name: str, first: Value, second: Value) -> bool:
    """Return whether a message lacks a field that the class reads of the one at first."""
    if not isinstance(first, Message) or not isinstance(second, Message):
        return False
    return any(
        isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Attribute)
        and node.value.attr == name
        and first.field(node.attr) is not None
        and second.field(node.attr) is None
        for module in types.source.own_modules
        for node in walk(module.tree.body)
    )


def _may_change(types: BehaviorTypes, name: str, first: Value) -> bool:
    """Return whether an attribute that is False at first may hold something else later."""
    if first != BOOL:
        return False
    tested: set[int] = set()
    for module in types.source.own_modules:
        for node in walk(module.tree.body):
            tested.update(id(item) for item in _tested(node))
    return any(
        isinstance(node, ast.Attribute)
        and node.attr == name
        and isinstance(node.ctx, ast.Load)
        and id(node) not in tested
        for module in types.source.own_modules
        for node in walk(module.tree.body)
    )


def _tested(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the expressions that a node only asks whether they are true, or compares."""
    match node:
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield test
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield operand
        case ast.BoolOp(values=values):
            yield from values
        case ast.Compare(left=left, comparators=others):
            yield from (left, *others)
