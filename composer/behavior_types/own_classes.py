"""The attributes of classes in the files of a behavior, and of their objects."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from enum import Enum
from functools import lru_cache

from composer.behavior_source import Class, Module
from composer.behavior_source.traversal import walk
from composer.behavior_types.bindings import bindings_of
from composer.behavior_types.names import full_name
from composer.behavior_types.self_attributes import defined_names
from composer.behavior_types.values import OwnClass

_ENUMS = frozenset({"enum.Enum", "enum.IntEnum", "enum.StrEnum"})
_DATACLASS = "dataclasses.dataclass"
_OF_DATACLASSES = frozenset({"__dataclass_fields__", "__dataclass_params__", "__match_args__"})


def class_named(name: str, module: Module) -> OwnClass | None:
    """Return the class at the top level of a module, if nothing else has its name."""
    found = module.classes.get(name)
    is_plain = name not in module.assigned and name not in module.imports
    return OwnClass(found, module) if found is not None and is_plain else None


@lru_cache(maxsize=256)
def known_attributes(owner: OwnClass) -> frozenset[str] | None:
    """Return all attributes of a class and of its objects; None if it may have others.

    Only plain classes, dataclasses and enumerations are known completely.
    """
    definition, home = owner.definition, owner.home
    bases = {full_name(base, home) or base for base in definition.bases}
    decorators = {_decorator(item, home) for item in definition.node.decorator_list}
    is_enum = bool(bases & _ENUMS)
    if bases - _ENUMS - {"object"} or decorators - {_DATACLASS} or definition.node.keywords:
        return None
    found = {*dir(Enum if is_enum else object), *_own(definition), *_assigned_from_outside(home)}
    if is_enum:
        found |= {"name", "value"}
    if {"__getattr__", "__getattribute__", "__setattr__"} & found - set(dir(object)):
        return None
    return frozenset(found | (_OF_DATACLASSES if decorators else set()))


def _decorator(node: ast.expr, home: Module) -> str:
    called = node.func if isinstance(node, ast.Call) else node
    written = ast.unparse(called)
    return full_name(written, home) or written


def _own(definition: Class) -> Iterator[str]:
    for statement in definition.node.body:
        yield from defined_names(statement, declared=True)
    for method in definition.methods:
        yield method.name
        if method.node is not None:
            yield from bindings_of(method.node).attributes


@lru_cache(maxsize=128)
def _assigned_from_outside(module: Module) -> frozenset[str]:
    """Return the names that the file assigns as attributes of anything but ``self``."""
    nodes = list(walk(module.tree.body))
    changed = {id(node.target) for node in nodes if isinstance(node, ast.AugAssign)}
    return frozenset(
        node.attr
        for node in nodes
        if isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and id(node) not in changed
        and not (isinstance(node.value, ast.Name) and node.value.id == "self")
    )
