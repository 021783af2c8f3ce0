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
from composer.fast_dataclass import dataclass

_ENUMS = frozenset({"enum.Enum", "enum.IntEnum", "enum.StrEnum"})
_NAMED_TUPLE = "typing.NamedTuple"
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
    is_tuple = _NAMED_TUPLE in bases
    if (
        bases - _ENUMS - {"object", _NAMED_TUPLE}
        or decorators - {_DATACLASS}
        or definition.node.keywords
    ):
        return None
    found = {*dir(Enum if is_enum else object), *_own(definition), *assigned_from_outside(home)}
    if is_enum:
        found |= {"name", "value"}
    if is_tuple:
        found |= {*dir(tuple), "_asdict", "_field_defaults", "_fields", "_make", "_replace"}
    if {"__getattr__", "__getattribute__", "__setattr__"} & found - set(dir(object)):
        return None
    return frozenset(found | (_OF_DATACLASSES if decorators else set()))


@dataclass(frozen=True, slots=True)
class ClassField:
    """A field of a dataclass or of a named tuple; ``value`` is its default, if it has one."""

    name: str
    annotation: ast.expr
    value: ast.expr | None


def has_fields(owner: OwnClass) -> bool:
    """Return whether a class is a dataclass or a named tuple without bases and constructor."""
    definition, home = owner.definition, owner.home
    bases = [full_name(base, home) or base for base in definition.bases]
    decorators = definition.node.decorator_list
    if {method.name for method in definition.methods} & {"__init__", "__new__"}:
        return False
    if bases == [_NAMED_TUPLE] and not decorators:
        return True
    if bases or len(decorators) != 1 or _decorator(decorators[0], home) != _DATACLASS:
        return False
    options = getattr(decorators[0], "keywords", ())
    return not {item.arg for item in options} & {"init", "kw_only", None}


def is_dataclass(owner: OwnClass) -> bool:
    """Return whether a class is a dataclass."""
    decorators = owner.definition.node.decorator_list
    return any(_decorator(item, owner.home) == _DATACLASS for item in decorators)


def fields_of_class(owner: OwnClass) -> Iterator[ClassField]:
    """Yield the fields of a dataclass or of a named tuple, in order."""
    for statement in owner.definition.node.body:
        match statement:
            case ast.AnnAssign(target=ast.Name(id=name), annotation=annotation, value=value):
                if "ClassVar" not in ast.unparse(annotation):
                    yield ClassField(name, annotation, value)


@lru_cache(maxsize=256)
def is_enumeration(owner: OwnClass, base: str | None = None) -> bool:
    """Return whether a class is an enumeration, derived from ``base`` if that is given."""
    wanted = _ENUMS if base is None else {base}
    return any((full_name(name, owner.home) or name) in wanted for name in owner.definition.bases)


def is_named_tuple(owner: OwnClass) -> bool:
    """Return whether a class is a NamedTuple."""
    bases = [full_name(base, owner.home) or base for base in owner.definition.bases]
    return bases == [_NAMED_TUPLE]


def is_plain(owner: OwnClass) -> bool:
    """Return whether objects of a class are nothing else than that: no numbers, texts or tuples."""
    bases = {full_name(base, owner.home) or base for base in owner.definition.bases}
    return known_attributes(owner) is not None and bases <= {"object", "enum.Enum"}


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
def assigned_from_outside(module: Module) -> frozenset[str]:
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
