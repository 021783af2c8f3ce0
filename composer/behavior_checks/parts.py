"""What expressions and attributes may have the value of, and the code outside functions."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import lru_cache
from types import GeneratorType

from composer.behavior_source import Module
from composer.behavior_source.method_body import is_none
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.outside_assignments import functions_of
from composer.behavior_types.syntax.bindings import Binding, How, bindings_of, nodes_of
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.values import Collection, OwnObject, Self, Value
from composer.interfaces import FieldType, Message


@lru_cache(maxsize=128)
def outside_functions(home: Module) -> ast.FunctionDef:
    """Return the statements of a module and of its classes, outside functions, as a function."""
    body: list[ast.stmt] = [
        item
        for statement in home.tree.body
        for item in (statement.body if isinstance(statement, ast.ClassDef) else (statement,))
        if isinstance(item, ast.Assign | ast.AnnAssign)
    ]
    nothing = ast.arguments(
        posonlyargs=[], args=[], kwonlyargs=[], kw_defaults=[], defaults=[], vararg=None, kwarg=None
    )
    return ast.FunctionDef(
        name="", args=nothing, body=body, decorator_list=[], returns=None, lineno=1, col_offset=0
    )


@lru_cache(maxsize=128)
def uses_numpy(home: Module) -> bool:
    """Return whether a file imports numpy."""
    return any(item.module.partition(".")[0] == "numpy" for item in home.imports.values())


def possible_values(node: ast.expr, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the expressions that an expression may have the value of."""
    match node:
        case ast.IfExp(body=first, orelse=second):
            yield from (*possible_values(first, scope), *possible_values(second, scope))
        case ast.BoolOp(op=ast.Or(), values=values):
            yield from (part for value in values for part in possible_values(value, scope))
        case ast.BoolOp(values=[*first, last]):
            # an empty list is a possible value; a message is never false
            yield from (value for value in first if _may_be_empty(scope.type_of(value)))
            yield from possible_values(last, scope)
        case ast.Name(id=name) if len(bindings := scope.bindings.names.get(name, [])) == 1:
            only = bindings[0]
            is_choice = isinstance(only.expression, ast.IfExp) and only.how is How.VALUE
            if is_choice and only.expression is not None and not only.positions:
                yield from possible_values(only.expression, scope)
            else:
                yield node
        case _:
            yield node


def stored_in(owner: Self | OwnObject, name: str, scope: FunctionTypes) -> list[Binding]:
    """Return what the methods of the class of an object store in an attribute of it."""
    if isinstance(owner, Self):
        return [binding for _, binding in scope.owner.assigned.get(name, ())]
    return [
        binding
        for own in (*lineage(owner.of).classes, *scope.owner.project_classes.derived(owner.of))
        for method in own.definition.methods
        if method.node is not None
        for binding in bindings_of(method.node).attributes.get(name, ())
    ]


def is_only_none(node: ast.Attribute, scope: FunctionTypes) -> bool:
    """Return whether nothing but None is stored in an attribute of an object of the project."""
    owner, types = scope.type_of(node.value), scope.owner
    if isinstance(owner, Self):
        is_known = types.source.complete and not types.self_escapes
    else:
        is_known = isinstance(owner, OwnObject) and known_attributes(owner.of) is not None
    if not is_known or not isinstance(owner, Self | OwnObject):
        return False
    if node.attr in types.project_classes.assigned_outside:
        return False
    stored = [binding.stored for binding in stored_in(owner, node.attr, scope)]
    return bool(stored) and all(map(is_none, stored)) and not _sets_by_name(types)


def _sets_by_name(types: BehaviorTypes) -> bool:
    """Return whether the files call ``setattr`` for anything but a message."""
    return any(
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "setattr"
        and not (node.args and isinstance(scope.type_of(node.args[0]), Message))
        for scope, function in functions_of(types)
        for node in nodes_of(function)
    )


def _may_be_empty(type_: Value) -> bool:
    is_array = isinstance(type_, FieldType) and type_.is_array
    return is_array or (isinstance(type_, Collection) and type_.python is not GeneratorType)


def scalar_name(node: ast.expr, type_: Value) -> str:
    """Return the name of a number or a text, "" for anything else."""
    is_single = isinstance(type_, FieldType) and type_.is_primitive and not type_.is_array
    return node.id if isinstance(node, ast.Name) and is_single else ""
