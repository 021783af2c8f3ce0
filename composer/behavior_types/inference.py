"""Infers the types of the attributes of a behavior."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cached_property

from composer.behavior_source import BehaviorSource, Function, Method, Module
from composer.behavior_types.api import attribute_class
from composer.behavior_types.bindings import Binding, Bindings, How, bindings_of
from composer.behavior_types.expressions import FunctionTypes, joined, with_changes
from composer.behavior_types.handlers import handler_arguments
from composer.behavior_types.self_attributes import escapes, self_attributes
from composer.behavior_types.values import ApiValue, OwnMethod, Parameters, Ports, Value
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING
from composer.interfaces import Interfaces
from composer.model import Node, PortKind

#: ``self.publishers`` and the like.
CONTAINERS: Mapping[str, PortKind] = {
    "publishers": PortKind.PUBLISHER,
    "clients": PortKind.CLIENT,
    "action_clients": PortKind.ACTION_CLIENT,
}


@dataclass()
class BehaviorTypes:
    """The types in the class of a behavior, used in one node."""

    node: Node
    source: BehaviorSource
    interfaces: Interfaces
    scopes: dict[int, FunctionTypes] = field(default_factory=dict)
    _known: dict[str, Value] = field(default_factory=dict)

    def scope(self, method: Method, home: Module) -> FunctionTypes | None:
        """Return the types within a method; None if its syntax is not known."""
        if method.node is None:
            return None
        if id(method.node) not in self.scopes:
            self.scopes[id(method.node)] = FunctionTypes(
                self, home, bindings_of(method.node), self._arguments(method)
            )
        return self.scopes[id(method.node)]

    def function(self, node: Function, home: Module, *, is_method: bool) -> FunctionTypes:
        """Return the types within a function outside the class of the behavior."""
        bindings = bindings_of(node, is_method=False)
        if is_method and (*node.args.posonlyargs, *node.args.args):
            bindings.name((*node.args.posonlyargs, *node.args.args)[0].arg)
        return FunctionTypes(self, home, bindings, {})

    @cached_property
    def self_attributes(self) -> frozenset[str]:
        """The attributes that the behavior may have, if its class is known completely."""
        declared = {
            statement.target.id
            for _, known in self.source.classes
            for statement in known.node.body
            if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name)
        }
        assigned = {
            name
            for name, bindings in self._assigned.items()
            if name not in declared or any(binding.creates for _, binding in bindings)
        }
        return self_attributes(self.source, assigned)

    @cached_property
    def self_escapes(self) -> bool:
        """Whether other code may set further attributes."""
        return escapes(self.source)

    def attribute(self, name: str) -> Value:
        """Return the type of ``self.<name>``."""
        if name not in self._known:
            self._known[name] = ANYTHING  # in case it is computed from itself
            self._known[name] = self._attribute(name)
        return self._known[name]

    def annotation(self, name: str) -> Value:
        """Return the type that an annotation gives to ``self.<name>``, ANYTHING without one."""
        for scope, binding in self._assigned.get(name, ()):
            if binding.how is How.ANNOTATION:
                return scope.bound(binding)
        return ANYTHING

    def _attribute(self, name: str) -> Value:
        method = self.source.method(name)
        if method is not None and method.node is not None:
            home = self._home(method)
            return OwnMethod(method, home) if method.known and home is not None else ANYTHING
        bindings = self._assigned.get(name, [])
        if bindings:
            found = joined((scope.bound(binding), binding.how) for scope, binding in bindings)
            return with_changes(found, self._changes(name))
        if method is not None:
            return ANYTHING
        if name in CONTAINERS:
            return Ports(CONTAINERS[name])
        if name == "parameters":
            return Parameters()
        api = attribute_class(name)
        return ApiValue(api) if api is not None else ANYTHING

    def _changes(self, name: str) -> Iterator[tuple[ast.operator, Value]]:
        """Yield what ``+=`` and the like do to ``self.<name>``."""
        for scope in self.scopes.values():
            for operator, value in scope.bindings.changes.get(name, ()):
                yield operator, scope.type_of(value)

    @cached_property
    def _assigned(self) -> dict[str, list[tuple[FunctionTypes, Binding]]]:
        """The bindings of the attributes of ``self``."""
        assigned: dict[str, list[tuple[FunctionTypes, Binding]]] = {}
        for home, known in self.source.classes:
            at_class = FunctionTypes(self, home, Bindings(), {})
            for name, binding in _of_class(known.node):
                assigned.setdefault(name, []).append((at_class, binding))
            for method in known.methods:
                scope = self.scope(method, home)
                if scope is not None:
                    for name, found in scope.bindings.attributes.items():
                        assigned.setdefault(name, []).extend((scope, item) for item in found)
        return assigned

    def _home(self, method: Method) -> Module | None:
        found = (home for home, known in self.source.classes if method in known.methods)
        return next(found, None)

    def _arguments(self, method: Method) -> Mapping[str, Value]:
        """Return the types of the arguments that the composer passes to a handler."""
        types = handler_arguments(self.node, self.interfaces).get(method.name, ())
        return dict(zip(method.arguments, types, strict=False))


def _of_class(node: ast.ClassDef) -> Iterator[tuple[str, Binding]]:
    """Yield the attributes that the body of a class assigns or declares."""
    for statement in node.body:
        match statement:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    if isinstance(target, ast.Name):
                        yield target.id, Binding(value)
            case ast.AnnAssign(target=ast.Name(id=name), annotation=annotation, value=value):
                yield name, Binding(annotation, How.ANNOTATION, creates=value is not None)
