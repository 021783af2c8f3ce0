"""The types of what objects give by special methods: called, iterated over, calculated with."""

from __future__ import annotations

import ast
from types import GeneratorType
from typing import TYPE_CHECKING

from composer.behavior_source.method_body import dotted
from composer.behavior_types.expressions.inferred import inferred_result
from composer.behavior_types.expressions.objects import attribute_of_object, returned_by
from composer.behavior_types.expressions.operators import NAMES, binary
from composer.behavior_types.libraries.iterables import element_of
from composer.behavior_types.libraries.rclpy_api import is_rclpy
from composer.behavior_types.syntax.bindings import CONTEXTS
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.values import (
    Collection,
    ModuleFunction,
    OwnMethod,
    OwnObject,
    Value,
)
from composer.field_types import ANYTHING

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes


def special_method(scope: FunctionTypes, owner: Value, name: str) -> ModuleFunction | None:
    """Return a method such as ``__call__`` of an object of a class of the project."""
    if not isinstance(owner, OwnObject) or is_rclpy(owner.of.home):
        return None
    if known_attributes(owner.of) is None:
        return None
    found = attribute_of_object(scope, owner, name)
    return found if isinstance(found, ModuleFunction) else None


def iterated(scope: FunctionTypes, owner: Value) -> Value:
    """Return the type of what iterating over a value gives."""
    method = special_method(scope, owner, "__iter__")
    if method is None or method.of is None:
        return element_of(owner)
    return element_of(_result(scope, method))


def iterable(scope: FunctionTypes, owner: Value) -> Value:
    """Return an iterator in place of an object whose class says how it is iterated over."""
    method = special_method(scope, owner, "__iter__")
    if method is None or method.of is None:
        return owner
    return Collection(GeneratorType, element_of(_result(scope, method)))


def item_of(scope: FunctionTypes, owner: Value) -> Value:
    """Return the type of an item of an object of the project, by an index or a key."""
    method = special_method(scope, owner, "__getitem__")
    return _result(scope, method) if method is not None and method.of is not None else ANYTHING


def calculated(scope: FunctionTypes, left: Value, operator: ast.operator, right: Value) -> Value:
    """Return the type of an operation, also of one that a class of the project defines."""
    name = NAMES[type(operator)]
    for owner, special in ((left, f"__{name}__"), (right, f"__r{name}__")):
        method = special_method(scope, owner, special)
        if method is not None:
            return _result(scope, method) if method.of is not None else ANYTHING
    return binary(left, operator, right)


def entered(scope: FunctionTypes, node: ast.expr) -> Value:
    """Return the type of what ``with ... as`` gives for an expression."""
    if isinstance(node, ast.Call):
        match scope.type_of(node.func):
            case OwnMethod(method=own, home=home) if own.node is not None:
                called: ModuleFunction | None = ModuleFunction(own.node, home)
            case ModuleFunction() as called:
                pass
            case _:
                called = None
        if called is not None and {dotted(item) for item in called.node.decorator_list} & CONTEXTS:
            return element_of(_result(scope, called))
    method = special_method(scope, scope.type_of(node), "__enter__")
    return _result(scope, method) if method is not None and method.of is not None else ANYTHING


def _result(scope: FunctionTypes, method: ModuleFunction) -> Value:
    """Return the type of what a method returns, without arguments that matter."""
    function, owner = method.node, scope.owner
    if function.returns is not None:
        return scope.annotated(function.returns, method.home)
    inside = owner.scopes.get(id(function)) or owner.function(function, method.home, method.of)
    return inferred_result(inside, function)


def called_object(scope: FunctionTypes, owner: Value, node: ast.Call) -> Value:
    """Return the type of what calling an object of the project gives."""
    method = special_method(scope, owner, "__call__")
    if method is None:
        return ANYTHING
    inside = scope.owner.function(method.node, method.home, method.of) if method.of else None
    return returned_by(scope, method, node, inside=inside)
