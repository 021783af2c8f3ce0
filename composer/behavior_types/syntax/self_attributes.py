"""The attributes that a behavior may have, and whether other code may set more of them."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache

from composer.behavior_source import BehaviorSource, Function, Module
from composer.behavior_source.traversal import walk
from composer.behavior_types.api import BEHAVIOR_ATTRIBUTES
from composer.behavior_types.syntax.bindings import is_static, nodes_of
from composer.behavior_types.syntax.names import own_name

#: The attributes of every object of a class.
ATTRIBUTES_OF_OBJECTS = frozenset({*dir(type("Plain", (), {})), *dir(type)})


def self_attributes(source: BehaviorSource, assigned: Iterable[str]) -> frozenset[str]:
    """Return the attributes of a behavior whose class is known completely."""
    of_behavior = {*ATTRIBUTES_OF_OBJECTS, *BEHAVIOR_ATTRIBUTES}
    return class_attributes(source, assigned) | of_behavior


def class_attributes(source: BehaviorSource, assigned: Iterable[str]) -> frozenset[str]:
    """Return the attributes that the class itself defines.

    ``assigned`` are those that its methods assign. A name in a string counts, because
    ``setattr(self, "name", ...)`` may set it.
    """
    found = {*assigned}
    for _, known in source.classes:
        found.update(method.name for method in known.methods)
        for statement in known.node.body:
            found.update(defined_names(statement))
    return frozenset(found)


def escapes(source: BehaviorSource, is_harmless: Callable[[str], bool] = lambda _: False) -> bool:
    """Return whether a class passes its object on, so that other code may set its attributes.

    ``is_harmless`` says which functions and classes, by full name, do not.
    """
    return any(
        method.node is not None and escapes_from(method.node, home, is_harmless)
        for home, known in source.classes
        for method in known.methods
    )


def sets_computed_names(source: BehaviorSource) -> bool:
    """Return whether a class sets attributes whose names it computes, so that any may exist."""
    return any(_sets_computed_names(known.node) for _, known in source.classes)


@lru_cache(maxsize=512)
def _sets_computed_names(class_node: ast.ClassDef) -> bool:
    return any(
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "setattr"
        and len(node.args) > 1
        and isinstance(node.args[0], ast.Name)
        and node.args[0].id == "self"
        and not isinstance(node.args[1], ast.Constant)
        for node in walk(class_node.body)
    )


def defined_names(statement: ast.stmt, *, declared: bool = False) -> Iterator[str]:
    """Yield the names that a statement of a class may define.

    ``name: type`` alone defines nothing, except in a dataclass: if ``declared`` is true.
    """
    if isinstance(statement, ast.AnnAssign) and statement.value is None and not declared:
        return
    is_function = isinstance(statement, Function)
    by_name = not is_function or _sets_by_name(statement)
    for node in walk([statement]):
        match node:
            case ast.Name(id=name) if not is_function:
                yield name
            case ast.ClassDef(name=name):
                yield name
            case ast.alias(name=name, asname=other) if not is_function:
                yield other or name.partition(".")[0]
            case ast.Constant(value=str() as name) if name.isidentifier() and by_name:
                yield name


def _sets_by_name(statement: ast.stmt) -> bool:
    """Return whether a function sets attributes by name, or asks for them, or may do so."""
    return any(
        (isinstance(node, ast.Name) and node.id in {"hasattr", "setattr", "vars"})
        or (isinstance(node, ast.Attribute) and node.attr in {"__dict__", "__setattr__"})
        for node in walk([statement])
    )


def escapes_from(function: Function, home: Module, is_harmless: Callable[[str], bool]) -> bool:
    """Return whether a method passes its object on."""
    positional = (*function.args.posonlyargs, *function.args.args)
    if not positional or is_static(function):
        return False
    receiver = positional[0].arg
    uses = 0
    for node in nodes_of(function):
        match node:
            case ast.Name(id=name) if name == receiver:
                uses += 1
            case ast.Attribute(value=ast.Name(id=name), attr=attribute) if name == receiver:
                if attribute == "__dict__":
                    return True
                uses -= 1
            case ast.Return(value=ast.Name(id=name)) | ast.Yield(value=ast.Name(id=name)):
                uses -= name == receiver  # to other code of the project
            case ast.Call(func=called) if is_harmless(own_name(called, home)):
                given = (*node.args, *(keyword.value for keyword in node.keywords))
                uses -= sum(isinstance(item, ast.Name) and item.id == receiver for item in given)
    return uses > 0
