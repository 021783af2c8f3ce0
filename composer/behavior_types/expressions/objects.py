"""The types of the attributes of objects and classes, own ones and those of rclpy."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from types import AsyncGeneratorType
from typing import TYPE_CHECKING

from composer.behavior_source import Function, Module
from composer.behavior_source.flow import is_stub, returns_nothing
from composer.behavior_source.method_body import argument, dotted
from composer.behavior_types.expressions.inferred import inferred_result
from composer.behavior_types.expressions.rebinding import joined, with_changes
from composer.behavior_types.libraries.rclpy_api import CLASSES, generic, is_rclpy
from composer.behavior_types.syntax.bindings import (
    CONTEXTS,
    Binding,
    How,
    bindings_of,
    nodes_of,
    reads_attribute,
)
from composer.behavior_types.syntax.lineage import RECORDS, lineage
from composer.behavior_types.syntax.literals import constant_type
from composer.behavior_types.syntax.own_classes import (
    all_fields,
    defines,
    fields_of_class,
    has_fields,
    is_enumeration,
    is_named_tuple,
)
from composer.behavior_types.values import (
    NONE,
    Collection,
    CollectionMethod,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnObject,
    Pending,
    Value,
    join_all,
    pair,
)
from composer.field_types import ANYTHING, STRING

if TYPE_CHECKING:
    from composer.behavior_types.expressions.function_types import FunctionTypes

_PROPERTIES = frozenset({"property", "cached_property", "functools.cached_property"})
#: Decorators of methods that change neither their arguments nor what they return.
_OF_METHODS = frozenset(
    {"abc.abstractmethod", "abstractmethod", "final", "override", "typing.override"}
)


def attribute_of_object(scope: FunctionTypes, owner: OwnObject, name: str) -> Value:
    """Return the type of an attribute of an object, from methods and annotations."""
    of = owner.of
    if is_enumeration(of) and name in {"name", "value"}:
        return STRING if name == "name" else value_of_member(of)
    if "typing.Protocol" in lineage(of).others:
        return ANYTHING
    for own in lineage(of).classes:
        for method in own.definition.methods:
            if method.name == name and method.node is not None:
                return method_value(scope, method.node, own, owner.parameter, of=of)
        for statement in own.definition.node.body:
            match statement:
                case ast.AnnAssign(target=ast.Name(id=found), annotation=annotation):
                    if found == name:
                        value = annotation_in(scope, annotation, own.home, owner.parameter)
                        is_descriptor = isinstance(value, OwnObject) and defines(
                            value.of, "__get__"
                        )
                        return ANYTHING if is_descriptor else value
    if is_named_tuple(of) and name in {"count", "index"}:
        return CollectionMethod(Collection(tuple), name)
    return ANYTHING if is_rclpy(of.home) else _assigned_in(scope, of, name)


def _is_descriptor(value: Value) -> bool:
    """Return whether reading an attribute with this value gives another one."""
    return isinstance(value, OwnObject) and defines(value.of, "__get__")


def annotation_of(scope: FunctionTypes, own: OwnClass, name: str) -> Value:
    """Return the type that a class annotates an attribute of its objects with, or ANYTHING."""
    for known in lineage(own).classes if not is_rclpy(own.home) else ():
        for statement in known.definition.node.body:
            match statement:
                case ast.AnnAssign(target=ast.Name(id=found), annotation=annotation):
                    if found == name:
                        return scope.annotated(annotation, known.home)
        for method in known.definition.methods:
            if method.node is None:
                continue
            if method.name == name:  # a property
                return ANYTHING
            for binding in bindings_of(method.node).attributes.get(name, ()):
                if binding.how is How.ANNOTATION and binding.expression is not None:
                    return scope.annotated(binding.expression, known.home)
    return ANYTHING


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
    return {item.name: scope.annotated(item.annotation, item.home) for item in all_fields(own)}


def unpacked_tuple(scope: FunctionTypes, value: Value) -> Value:
    """Return the tuple that unpacking a named tuple gives, or else the value."""
    if not isinstance(value, OwnObject) or not is_named_tuple(value.of):
        return value
    if "__iter__" in {method.name for method in value.of.definition.methods}:
        return value
    return pair(*fields_expected(scope, value.of).values())


def value_in_record(scope: FunctionTypes, owner: OwnObject, key: object) -> Value:
    """Return the type of the value of a key of a TypedDict, ANYTHING for other objects."""
    family = lineage(owner.of)
    if not family.others & RECORDS:
        return ANYTHING
    for own in family.classes:
        for field in fields_of_class(own):
            if field.name == key:
                return scope.annotated(field.annotation, own.home)
    return ANYTHING


def _assigned_in(scope: FunctionTypes, own: OwnClass, name: str) -> Value:
    """Return the type of what the methods of a class assign to an attribute of its objects."""
    key = (id(own.definition), name)
    known = scope.owner.of_objects
    if key not in known:
        known[key] = ANYTHING  # in case it is computed from itself
        known[key] = _assigned_to(scope, own, name)
    return known[key]


def _assigned_to(scope: FunctionTypes, own: OwnClass, name: str) -> Value:
    owner = scope.owner
    if name in owner.project_classes.assigned_outside:
        return ANYTHING
    plain: list[tuple[Value, How]] = []
    computed: list[tuple[FunctionTypes, Binding]] = []
    changes: list[tuple[FunctionTypes, ast.operator, ast.expr]] = []
    for known in (*lineage(own).classes, *owner.project_classes.derived(own)):
        for statement in known.definition.node.body:
            match statement:
                case ast.Assign(targets=[ast.Name(id=target)], value=value) if target == name:
                    plain.append((_of_constant(value, scope, known.home), How.VALUE))
        for method in known.definition.methods:
            if method.node is None:
                continue
            bindings = bindings_of(method.node)
            inside = owner.function(method.node, known.home, known)
            for binding in bindings.attributes.get(name, ()):
                if reads_attribute(binding.expression, bindings.receiver, name):
                    computed.append((inside, binding))
                else:
                    plain.append((_stored(inside, binding), binding.how))
            changed = bindings.changes.get(name, ())
            changes += [(inside, operator, value) for operator, value in changed]
    first = joined(plain) if plain else ANYTHING
    if first is NONE or first is ANYTHING:
        return ANYTHING
    scope.owner.of_objects[id(own.definition), name] = first
    found = [
        (first, How.VALUE),
        *((item.bound(binding), binding.how) for item, binding in computed),
    ]
    given = ((operator, item.type_of(value)) for item, operator, value in changes)
    if joined(found) == first and with_changes(first, given) == first:
        return first
    owner.forget_expressions()
    return ANYTHING


def _stored(inside: FunctionTypes, binding: Binding) -> Value:
    """Return the type of an attribute; what is in a list or a dict may change later."""
    found = inside.bound(binding)
    is_display = isinstance(binding.expression, ast.Dict | ast.List | ast.Set | ast.Tuple)
    if is_display and binding.how is How.VALUE and isinstance(found, Collection):
        return Collection(found.python, is_empty=found.is_empty)
    return found


def _is_not_implemented(function: Function) -> bool:
    """Return whether a method only raises NotImplementedError: others may take other arguments."""
    match function.body[-1]:
        case ast.Raise(exc=ast.expr() as raised):
            return "NotImplementedError" in ast.unparse(raised)
        case _:
            return False


def method_value(
    scope: FunctionTypes,
    function: Function,
    own: OwnClass,
    parameter: Value = ANYTHING,
    *,
    of: OwnClass | None = None,
) -> Value:
    """Return the type of an attribute of an object that is a method or a property.

    ``own`` is the class that defines it, ``of`` that of the object, if that is not the behavior.
    """
    decorators = {dotted(item) for item in function.decorator_list}
    if decorators & _PROPERTIES and decorators <= _PROPERTIES | _OF_METHODS:
        if isinstance(function, ast.AsyncFunctionDef):
            return ANYTHING
        if function.returns is not None:
            return annotation_in(scope, function.returns, own.home, parameter)
        is_only = of is not None and not _may_differ(scope, of, function.name)
        inside = scope.owner.function(function, own.home, own)
        return inferred_result(inside, function) if is_only else ANYTHING
    if not decorators <= {"staticmethod", "classmethod"} | _OF_METHODS | CONTEXTS:
        return ANYTHING
    is_only = (
        of is not None and not is_rclpy(own.home) and not _may_differ(scope, of, function.name)
    )
    defining = own if is_only else None
    is_bound = function.name != "__new__"
    return ModuleFunction(function, own.home, is_bound=is_bound, parameter=parameter, of=defining)


def attribute_of_class(scope: FunctionTypes, owner: OwnClass, name: str) -> Value:
    """Return the type of an attribute of a class: a member of an enumeration, or a function."""
    if name.startswith("__"):
        return ANYTHING
    is_enum = is_enumeration(owner)
    for own in lineage(owner).classes:
        method = next((item for item in own.definition.methods if item.name == name), None)
        if method is not None and method.node is not None:
            return _function_of_class(method.node, own)
        for statement in own.definition.node.body:
            match statement:
                case ast.Assign(targets=[ast.Name(id=found)], value=value) if found == name:
                    if is_enum:
                        return OwnObject(owner)
                    return _of_constant(value, scope, own.home)
                case ast.AnnAssign(target=ast.Name(id=found), annotation=annotation, value=value):
                    if found == name and value is not None:
                        return scope.annotated(annotation, own.home)
        if method is not None:
            return ANYTHING
    return ANYTHING


def _of_constant(node: ast.expr, scope: FunctionTypes, home: Module) -> Value:
    """Return the type of what the body of a class assigns, if it cannot change."""
    if isinstance(node, ast.Constant):
        return constant_type(node.value)
    is_fixed = isinstance(node, ast.Tuple)
    return scope.owner.at_module(home).type_of(node) if is_fixed else ANYTHING


def _function_of_class(function: Function, own: OwnClass) -> Value:
    decorators = {dotted(item) for item in function.decorator_list}
    if not decorators <= {"staticmethod", "classmethod"} | _OF_METHODS:
        return ANYTHING
    is_bound = not is_rclpy(own.home) and bool(decorators & {"staticmethod", "classmethod"})
    return ModuleFunction(function, own.home, is_bound=is_bound or is_rclpy(own.home), of=own)


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
    called: ModuleFunction,
    call: ast.Call,
    *,
    inside: FunctionTypes | None = None,
) -> Value:
    """Return the type of a call of a function: that of its annotation, or of what it returns.

    ``inside`` are the types within the function, if what it returns is known to be that.
    """
    function, home, parameter = called.node, called.home, called.parameter
    result: Value = ANYTHING
    is_plain = not function.decorator_list
    if {dotted(item) for item in function.decorator_list} & CONTEXTS:
        return ANYTHING
    if function.returns is not None:
        result = annotation_in(scope, function.returns, home, parameter)
    elif not is_rclpy(home) and returns_nothing(function):
        result = NONE
    elif inside is not None and not is_stub(function) and has_plain_result(function):
        result = inferred_result(inside, function)
    if not isinstance(function, ast.AsyncFunctionDef):
        return result
    if not is_plain:
        return ANYTHING
    if any(isinstance(inner, ast.Yield) for inner in nodes_of(function)):
        element = result.element if isinstance(result, Collection) else ANYTHING
        return Collection(AsyncGeneratorType, element)
    return Pending(function.name, call, result)


def has_plain_result(function: Function) -> bool:
    """Return whether a call of a function returns what its body does."""
    decorators = {dotted(item) for item in function.decorator_list}
    return decorators <= {"staticmethod", "classmethod", *_PROPERTIES, *_OF_METHODS}


def _may_differ(scope: FunctionTypes, of: OwnClass, name: str) -> bool:
    """Return whether a class that is derived from ``of`` defines a method again."""
    return any(
        method.name == name
        for own in scope.owner.project_classes.derived(of)
        for method in own.definition.methods
    )
