"""Which values are functions and methods."""

from __future__ import annotations

from composer.behavior_source import Function
from composer.behavior_source.method_body import dotted
from composer.behavior_types.libraries.numpy_names import METHODS_OF_ARRAYS, ndarray
from composer.behavior_types.syntax.bindings import TRANSPARENT
from composer.behavior_types.values import (
    ApiMethod,
    BuiltinMethod,
    Collection,
    CollectionMethod,
    ModuleFunction,
    OwnMethod,
    Value,
)


def is_function(value: Value) -> bool:
    """Return whether a value is a function or a method, which was not called."""
    match value:
        case ModuleFunction(node=node):
            return {dotted(item) for item in node.decorator_list} <= TRANSPARENT
        case OwnMethod() | ApiMethod():
            return True
        case CollectionMethod(owner=Collection(python=python), name=name):
            return callable(getattr(python, name, None))
        case BuiltinMethod(python=python, name=name):
            # what is known of the classes of numpy are names only
            if python is ndarray:
                return name in METHODS_OF_ARRAYS
            is_numpy = python.__module__.startswith("composer.")
            return not is_numpy and callable(getattr(python, name, None))
        case _:
            return False


def definition_of(value: Value) -> Function | None:
    """Return the definition of a function or a method in the files of a behavior, or None."""
    match value:
        case OwnMethod(method=method):
            return method.node
        case ModuleFunction(node=node):
            return node
        case _:
            return None


def function_name(value: Value) -> str:
    """Return the name of a function or a method."""
    match value:
        case OwnMethod(method=method):
            return method.name
        case ModuleFunction(node=node):
            return node.name
        case ApiMethod(member=member):
            return member.name
        case CollectionMethod(name=name) | BuiltinMethod(name=name):
            return name
        case _:
            return ""
