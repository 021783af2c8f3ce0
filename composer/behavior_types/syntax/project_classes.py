"""How the files of a behavior use their own classes: what they derive, create and set."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import cached_property

from composer.behavior_source import Function, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_source.traversal import walk
from composer.behavior_types.syntax.bindings import is_class_method
from composer.behavior_types.syntax.lineage import class_named, lineage
from composer.behavior_types.syntax.own_classes import assigned_from_outside, is_enumeration
from composer.behavior_types.values import OwnClass


class ProjectClasses:
    """The classes in the files of a behavior."""

    def __init__(self, modules: Sequence[Module]) -> None:
        """Look at the classes in these files."""
        self._modules = modules

    @cached_property
    def assigned_outside(self) -> frozenset[str]:
        """The attributes that any of the files assigns to anything but ``self``."""
        return frozenset().union(*map(assigned_from_outside, self._modules))

    def derived(self, own: OwnClass) -> tuple[OwnClass, ...]:
        """Return the classes that are derived from one."""
        return self._derived.get(own, ())

    def is_created(self, own: OwnClass) -> bool:
        """Return whether the files create objects of a class, or of one derived from it.

        A class that is only annotated, or only derived from, may be one of a larger interface.
        """
        return is_enumeration(own) or any(item in self._used for item in (own, *self.derived(own)))

    def is_object(self, own: OwnClass) -> bool:
        """Return whether ``self`` in the methods of a class is an object of it.

        What a class that only others are derived from needs, may be in these: a mixin.
        """
        is_abstract = "abc.ABC" in lineage(own).others
        return own in self._used or is_enumeration(own) or (is_abstract and self.is_created(own))

    @cached_property
    def _derived(self) -> dict[OwnClass, tuple[OwnClass, ...]]:
        found: dict[OwnClass, tuple[OwnClass, ...]] = {}
        for module in self._modules:
            for known in module.classes.values():
                own = OwnClass(known, module)
                for base in lineage(own).classes[1:]:
                    found[base] = (*found.get(base, ()), own)
        return found

    @cached_property
    def _used(self) -> frozenset[OwnClass]:
        found: set[OwnClass] = set()
        for module in self._modules:
            for name in set(_values(module.tree.body)) - {""}:
                own = class_named(name, module)
                if own is None:  # Class.method(...), where the method creates an object
                    owner, _, method = name.rpartition(".")
                    own = class_named(owner, module) if owner else None
                    own = own if own is not None and _creates(own, method) else None
                if own is not None:
                    found.add(own)
        return frozenset(found)


def _values(body: Sequence[ast.AST]) -> Iterator[str]:
    """Yield the dotted names of what is called, raised, or given by name, as a factory."""
    for node in walk(body):
        found: list[ast.expr | None] = []
        match node:
            case ast.Call(func=function, keywords=keywords):
                found = [function, *(item.value for item in keywords)]
            case ast.Raise(exc=exc):
                found = [exc]
        yield from (dotted(item) for item in found if item is not None)


def _creates(own: OwnClass, name: str) -> bool:
    """Return whether a class method creates an object of its class by ``cls(...)``."""
    for method in own.definition.methods:
        if method.name == name and method.node is not None and is_class_method(method.node):
            first = method.node.args.args[0].arg if method.node.args.args else ""
            return first in set(_values(method.node.body))
    return False


def takes_object(function: Function) -> bool:
    """Return whether the first argument of a method is its object, as in plain methods."""
    names = {dotted(item) for item in function.decorator_list}
    first = (*function.args.posonlyargs, *function.args.args)[:1]
    is_annotated = any(item.annotation is not None for item in first)
    return not is_annotated and not names & {"classmethod", "staticmethod"}
