"""The types of the attributes of objects and classes, own ones and those of rclpy."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import TYPE_CHECKING

from composer.behavior_source import Function, Module
from composer.behavior_source.flow import returns_nothing
from composer.behavior_source.method_body import argument, dotted
from composer.behavior_types.bindings import How, bindings_of, nodes_of
from composer.behavior_types.literals import constant_type
from composer.behavior_types.own_classes import (
    assigned_from_outside,
    fields_of_class,
    has_fields,
    is_enumeration,
)
from composer.behavior_types.rclpy_api import CLASSES, generic, is_rclpy
from composer.behavior_types.rebinding import joined
from composer.behavior_types.values import (
    NONE,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnObject,
    Pending,
    Value,
    join_all,
)
from composer.field_types import ANYTHING, STRING

if TYPE_CHECKING:
    from composer.behavior_types.expressions import FunctionTypes


def attribute_of_object(scope: FunctionTypes, owner: OwnObject, name: str) -> Value:
    """Return the type of an attribute of an object, from methods and annotations."""
    of = owner.of
    if is_enumeration(of) and name in {"name", "value"}:
        return STRING if name == "name" else value_of_member(of)
    for method in of.definition.methods:
        if method.name == name and method.node is not None:
            return method_value(scope, method.node, of.home, owner.parameter)
    for statement in of.definition.node.body:
        match statement:
            case ast.AnnAssign(target=ast.Name(id=found), annotation=annotation):
                if found == name:
                    return annotation_in(scope, annotation, of.home, owner.parameter)
    return ANYTHING if is_rclpy(of.home) else _assigned_in(scope, of, name)


def value_of_member(own: OwnClass) -> Value:
    """Return the type of the value of a member of an enumeration of constants."""
    if is_rclpy(own.home) or {method.name for method in own.definition.methods if method.node}:
        return ANYTHING  # a method may compute the values
    values = [item.value for item in own.definition.node.body if isinstance(item, ast.Assign)]
    return join_all(
        constant_type(value.value) if isinstance(value, ast.Constant) else ANYTHING
        for value in values
    )


def fields_expected(scope: FunctionTypes, own: OwnClass) -> Mapping[str, Value]:
    """Return the types of the fields of a dataclass or a named tuple, by name."""
    if not has_fields(own):
        return {}
    fields = fields_of_class(own)
    return {item.name: scope.annotated(item.annotation, own.home) for item in fields}


def _assigned_in(scope: FunctionTypes, own: OwnClass, name: str) -> Value:
    """Return the type of what the methods of a class assign to an attribute of its objects."""
    key = (id(own.definition), name)
    known = scope.owner.of_objects
    if key not in known:
        known[key] = ANYTHING  # in case it is computed from itself
        known[key] = _assigned_to(scope, own, name)
    return known[key]


def _assigned_to(scope: FunctionTypes, own: OwnClass, name: str) -> Value:
    if name in assigned_from_outside(own.home):
        return ANYTHING
    found: list[tuple[Value, How]] = []
    for method in own.definition.methods:
        if method.node is None:
            continue
        bindings = bindings_of(method.node)
        if name in bindings.changes:
            return ANYTHING
        inside = type(scope)(scope.owner, own.home, bindings, {})
        for binding in bindings.attributes.get(name, ()):
            of_itself = binding.expression is None or _reads(binding.expression, bindings.receiver)
            found.append((ANYTHING if of_itself else inside.bound(binding), binding.how))
    return joined(found) if found else ANYTHING


def _reads(node: ast.expr, receiver: str | None) -> bool:
    """Return whether an expression reads the object that a method belongs to."""
    return any(isinstance(item, ast.Name) and item.id == receiver for item in ast.walk(node))


def method_value(
    scope: FunctionTypes, function: Function, home: Module, parameter: Value = ANYTHING
) -> Value:
    """Return the type of an attribute of an object that is a method or a property."""
    decorators = [dotted(item) for item in function.decorator_list]
    if decorators in (["property"], ["cached_property"], ["functools.cached_property"]):
        if function.returns is None or isinstance(function, ast.AsyncFunctionDef):
            return ANYTHING
        return annotation_in(scope, function.returns, home, parameter)
    if decorators not in ([], ["staticmethod"]):
        return ANYTHING
    return ModuleFunction(function, home, is_bound=True, parameter=parameter)


def attribute_of_class(owner: OwnClass, name: str) -> Value:
    """Return the type of an attribute of a class: a member of an enumeration, or a function."""
    is_enum = is_enumeration(owner)
    for statement in owner.definition.node.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=found)], value=value) if found == name:
                if is_enum:
                    return OwnObject(owner)
                return constant_type(value.value) if isinstance(value, ast.Constant) else ANYTHING
            case ast.FunctionDef(name=found, decorator_list=[ast.Name(id="staticmethod")]):
                if found == name:
                    return ModuleFunction(statement, owner.home, is_bound=True)
    return ANYTHING


def annotation_in(
    scope: FunctionTypes, annotation: ast.expr, home: Module, parameter: Value = ANYTHING
) -> Value:
    """Return the type of an annotation in ``home``, in an object with that ``parameter``."""
    if is_rclpy(home):
        return generic(annotation, parameter, lambda node: scope.annotated(node, home))
    return scope.annotated(annotation, home)


def given_class(
    scope: FunctionTypes, function: Function, call: ast.Call, *, is_bound: bool
) -> Value:
    """Return the class of an interface that a call of rclpy takes, as in ``create_client``."""
    if function.name in {"declare_parameter", "get_parameter"}:
        return scope.owner.declared_value(call)
    positional = function.args.args[1 if is_bound else 0 :]
    for at, item in enumerate(positional):
        if isinstance(item.annotation, ast.Name) and item.annotation.id in CLASSES:
            given = argument(call, at, item.arg)
            found = scope.type_of(given) if given is not None else ANYTHING
            return found if isinstance(found, InterfaceClass) else ANYTHING
    return ANYTHING


def created_object(scope: FunctionTypes, own: OwnClass, call: ast.Call) -> Value:
    """Return the type of an object that a call of its class creates."""
    if not is_rclpy(own.home):
        return OwnObject(own)
    methods = {method.name: method.node for method in own.definition.methods}
    function = methods.get("__init__")
    given = given_class(scope, function, call, is_bound=True) if function else ANYTHING
    return OwnObject(own, given)


def returned_by(
    scope: FunctionTypes,
    function: Function,
    home: Module,
    call: ast.Call,
    parameter: Value = ANYTHING,
) -> Value:
    """Return the type of a call of a function: that of its annotation, or None."""
    result: Value = ANYTHING
    if function.returns is not None:
        result = annotation_in(scope, function.returns, home, parameter)
    elif not is_rclpy(home) and returns_nothing(function):
        result = NONE
    if not isinstance(function, ast.AsyncFunctionDef):
        return result
    is_plain = not function.decorator_list and not any(
        isinstance(inner, ast.Yield) for inner in nodes_of(function)
    )
    return Pending(function.name, call, result) if is_plain else ANYTHING
