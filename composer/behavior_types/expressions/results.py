"""The types of what calls return."""

from __future__ import annotations

import ast
from typing import TYPE_CHECKING

from composer.behavior_types.expressions.objects import created_object, given_class, returned_by
from composer.behavior_types.expressions.protocols import called_object, iterable
from composer.behavior_types.libraries.api_values import api_result
from composer.behavior_types.libraries.iterables import ITERATING
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.libraries.standard_types import builtin_result, called, method_result
from composer.behavior_types.syntax.own_classes import is_named_tuple
from composer.behavior_types.values import (
    AnyFunction,
    ApiMethod,
    BuiltinMethod,
    CollectionMethod,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    OwnObject,
    Pending,
    Value,
)
from composer.field_types import ANYTHING
from composer.interfaces import FieldType, Message

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes


def result_of(scope: FunctionTypes, node: ast.Call) -> Value:
    """Return the type of what a call returns."""
    match scope.type_of(node.func):
        case InterfaceClass(definition=Message() as message):
            return message
        case ApiMethod(owner=owner, member=member):
            result = api_result(owner, member.name, scope.owner.interfaces)
            if (owner.class_name, member.name) == ("Transforms", "transform") and node.args:
                given = scope.type_of(node.args[0])  # the same message in another frame
                result = given if isinstance(given, Message) else ANYTHING
            return Pending(member.name, node, result) if member.is_async else result
        case OwnMethod(method=method, home=home) if method.node is not None:
            function = ModuleFunction(method.node, home)
            return returned_by(scope, function, node, inside=scope.owner.scope(method, home))
        case ModuleFunction(home=home) as function if is_rclpy(home):
            if function.parameter is ANYTHING:
                given = given_class(scope, function.node, node, is_bound=True)
                function = ModuleFunction(function.node, home, parameter=given)
            return returned_by(scope, function, node)
        case ModuleFunction() as function:
            is_known = function.of is not None or not function.is_bound
            types = scope.owner.function(function.node, function.home, function.of)
            return returned_by(scope, function, node, inside=types if is_known else None)
        case AnyFunction(result=result):
            return result
        case OwnClass() as own:
            return created_object(scope, own, node)
        case OwnObject() as owner if not is_rclpy(owner.of.home):
            return called_object(scope, owner, node)
        case BuiltinMethod(python=python, name=name):
            named = {item.arg: scope.type_of(item.value) for item in node.keywords if item.arg}
            return builtin_result(python, name, [scope.type_of(item) for item in node.args], named)
        case CollectionMethod(owner=collection, name=name):
            return method_result(collection, name, [scope.type_of(item) for item in node.args])
    changed = changed_tuple(scope, node)
    if changed is not None:
        return changed
    full = scope.called_name(node.func)
    if full == "super" and not node.args:
        return scope.owner.parent(scope)
    if not full or any(isinstance(item, ast.Starred) for item in node.args):
        return ANYTHING
    named = {item.arg: scope.type_of(item.value) for item in node.keywords if item.arg}
    arguments = [scope.type_of(item) for item in node.args]
    if full in ITERATING or (full in {"max", "min"} and len(arguments) == 1):
        arguments = [iterable(scope, item) for item in arguments]
    found = called(full, arguments, named)
    return scope.normal(found) if isinstance(found, FieldType) else found


def changed_tuple(scope: FunctionTypes, call: ast.Call) -> OwnObject | None:
    """Return the named tuple that a call of ``_replace`` changes, None for other calls."""
    if not isinstance(call.func, ast.Attribute) or call.func.attr != "_replace":
        return None
    found = scope.type_of(call.func.value)
    return found if isinstance(found, OwnObject) and is_named_tuple(found.of) else None


def awaited(awaitable: Value) -> Value:
    """Return the type of what waiting for a value gives."""
    match awaitable:
        case Pending(result=result):
            return result
        case OwnObject(of=of, parameter=parameter) if is_rclpy(of.home):
            return parameter
        case _:
            return ANYTHING
