"""Checks what Python does when it defines a class: decorators, fields, ``__slots__``."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Class, Function, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_source.syntax import name_span
from composer.behavior_types.syntax.bindings import bindings_of, is_class_method, is_static
from composer.behavior_types.syntax.lineage import PLAIN_BASES, lineage
from composer.behavior_types.syntax.names import full_name
from composer.behavior_types.syntax.own_classes import (
    ClassField,
    all_fields,
    constructor_of,
    is_dataclass,
    known_attributes,
    misplaced_field,
)
from composer.behavior_types.syntax.project_classes import ProjectClasses
from composer.behavior_types.values import OwnClass

#: Decorators that take the function itself, and fail without it.
_OF_FUNCTIONS = frozenset(
    {"classmethod", "property", "staticmethod"}
    | {"abc.abstractmethod", "contextlib.asynccontextmanager", "contextlib.contextmanager"}
    | {"functools.cache", "functools.cached_property", "typing.final", "typing.override"}
)


def definition_problems(home: Module, classes: ProjectClasses) -> Iterator[CodeProblem]:
    """Yield why the definitions of the classes and functions in a file fail, or their objects."""
    for item in home.tree.body:
        if isinstance(item, Function):
            yield from _decorators(item, home)
    for definition in home.classes.values():
        for method in definition.methods:
            if method.node is not None:
                yield from _decorators(method.node, home)
        own = OwnClass(definition, home)
        yield from _order(own)
        yield from _after_creation(own)
        yield from _not_annotated(own)
        # a class that only others are derived from may leave the places for attributes to these
        if classes.is_created(own) and not classes.derived(own):
            yield from _slots(own)


def _decorators(function: Function, home: Module) -> Iterator[CodeProblem]:
    for node in function.decorator_list:
        if isinstance(node, ast.Call) and not node.args and not node.keywords:
            written = dotted(node.func)
            if (full_name(written, home) or written) in _OF_FUNCTIONS:
                message = f"'{written}' is called without the function that it decorates"
                yield CodeProblem(
                    Kind.CALL, message, span_of(node, home.source), f"write @{written}"
                )


def _order(own: OwnClass) -> Iterator[CodeProblem]:
    field = misplaced_field(own)
    if field is not None and _declares(own, field):
        message = f"field '{field.name}' has no default, but follows one that has"
        span = span_of(field.annotation, own.home.source)
        hint = "move it before the fields with defaults, or give it one"
        yield CodeProblem(Kind.VALUE, message, span, hint)


def _not_annotated(own: OwnClass) -> Iterator[CodeProblem]:
    """Yield the fields without an annotation, which a dataclass does not take for fields."""
    for statement in own.definition.node.body if is_dataclass(own) else ():
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(func=function)):
                written = dotted(function)
                if (full_name(written, own.home) or written) == "dataclasses.field":
                    message = f"'{name}' is not a field without an annotation"
                    span = span_of(statement.targets[0], own.home.source)
                    yield CodeProblem(Kind.VALUE, message, span, f"write '{name}: type = ...'")


def _declares(own: OwnClass, field: ClassField) -> bool:
    return any(
        isinstance(item, ast.AnnAssign) and item.annotation is field.annotation
        for item in own.definition.node.body
    )


def _after_creation(own: OwnClass) -> Iterator[CodeProblem]:
    """Yield why a dataclass cannot call its ``__post_init__``, to which it passes InitVars only."""
    function = _method(own.definition, "__post_init__")
    family = lineage(own)
    if function is None or not isinstance(constructor_of(own), OwnClass):
        return
    if not is_dataclass(own) or function.decorator_list or not family.others <= PLAIN_BASES:
        return
    passed = sum("InitVar" in ast.unparse(item.annotation) for item in all_fields(own))
    arguments = function.args
    most = len(arguments.posonlyargs) + len(arguments.args) - 1
    least = most - len(arguments.defaults)
    is_open = arguments.vararg is not None
    by_name = any(default is None for default in arguments.kw_defaults)
    if least <= passed and (passed <= most or is_open) and not by_name:
        return
    given = f"{passed or 'no'} argument{'' if passed == 1 else 's'}"
    message = f"the dataclass '{own.definition.name}' calls '__post_init__' with {given}"
    span = name_span(function, "def", own.home.source)
    yield CodeProblem(Kind.CALL, message, span, "an InitVar is passed to it")


def _method(definition: Class, name: str) -> Function | None:
    found = (item.node for item in definition.methods if item.name == name)
    return next(found, None)


def _slots(own: OwnClass) -> Iterator[CodeProblem]:
    """Yield the attributes that methods set, although ``__slots__`` leaves no place for them."""
    family, known = lineage(own), known_attributes(own)
    if known is None or not family.others <= PLAIN_BASES:
        return
    slots: set[str] = set()
    for item in family.classes:
        of_class = _slots_of(item.definition)
        if of_class is None:
            return
        slots |= of_class
    if "__dict__" in slots:
        return
    members = {method.name for item in family.classes for method in item.definition.methods}
    reported: set[str] = set()
    for method in own.definition.methods:
        function = method.node
        if function is None or is_static(function) or is_class_method(function):
            continue
        receiver = bindings_of(function).receiver
        for node in ast.walk(function):
            match node:
                case ast.Attribute(value=ast.Name(id=owner), attr=name, ctx=ast.Store()):
                    if owner == receiver and name not in slots | members | reported:
                        reported.add(name)
                        message = f"'{own.definition.name}' has no slot '{name}'"
                        span = span_of(node, own.home.source)
                        hint = f"add '{name}' to __slots__"
                        yield CodeProblem(Kind.ATTRIBUTE, message, span, hint)


def _slots_of(definition: Class) -> set[str] | None:
    """Return the names in ``__slots__``, None if they are not known."""
    for statement in definition.node.body:
        match statement:
            case ast.Assign(targets=[ast.Name(id="__slots__")], value=value):
                pass
            case ast.AnnAssign(target=ast.Name(id="__slots__"), value=ast.expr() as value):
                pass
            case _:
                continue
        items = value.elts if isinstance(value, ast.List | ast.Set | ast.Tuple) else [value]
        names = [item.value for item in items if isinstance(item, ast.Constant)]
        texts = {name for name in names if isinstance(name, str)}
        return texts if len(texts) == len(items) else None
    return None
