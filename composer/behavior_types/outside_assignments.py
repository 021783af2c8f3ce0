"""The attributes that code sets of objects of other classes."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import TYPE_CHECKING

from composer.behavior_source import Function
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import created_attributes, nodes_of
from composer.behavior_types.values import OwnClass, Self
from composer.interfaces import FieldType, Message

if TYPE_CHECKING:
    from composer.behavior_types.inference import BehaviorTypes

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def set_from_outside(types: BehaviorTypes) -> Iterator[str]:
    """Yield the attributes that the files set of objects other than ``self`` and messages."""
    names = types.project_classes.assigned_outside
    for home in types.source.own_modules:
        for node in walk(home.tree.body, closed=_FUNCTIONS):
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                yield node.attr
    for scope, function in functions_of(types):
        for node in nodes_of(function):
            match node:
                case ast.Attribute(value=owner, attr=name, ctx=ast.Store()) if name in names:
                    if not isinstance(scope.type_of(owner), FieldType | Message | Self):
                        yield name


def functions_of(types: BehaviorTypes) -> Iterator[tuple[FunctionTypes, Function]]:
    """Yield all functions and methods of the files, each with its types."""
    own = {id(known) for _, known in types.source.classes}
    for home in types.source.own_modules:
        for item in home.tree.body:
            if isinstance(item, Function):
                yield types.function(item, home), item
        for known in home.classes.values():
            for method in known.methods:
                if method.node is None:
                    continue
                if id(known) in own:
                    scope = types.scope(method, home)
                else:
                    scope = types.function(method.node, home, OwnClass(known, home))
                if scope is not None:
                    yield scope, method.node


def set_by_methods(types: BehaviorTypes) -> frozenset[str]:
    """Return the attributes that the methods of a class set, besides computing them again."""
    return frozenset(
        name
        for home, known in types.source.classes
        for method in known.methods
        if (scope := types.scope(method, home)) is not None and method.node is not None
        for name in created_attributes(method.node, scope.bindings)
    )
