"""Infers the types of the attributes of a behavior."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING

from composer.behavior_source import BehaviorSource, Function, Method, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_types.api import attribute_class
from composer.behavior_types.assumptions import Assumed, is_open, lacks
from composer.behavior_types.expressions.fillings import (
    Filling,
    filled,
    fillings_of,
    is_fresh,
    without_none,
)
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import method_value
from composer.behavior_types.expressions.rebinding import joined, with_changes
from composer.behavior_types.libraries.handlers import Handler, handlers_of
from composer.behavior_types.libraries.rclpy_api import rclpy_object
from composer.behavior_types.outside_assignments import set_by_methods, set_from_outside
from composer.behavior_types.syntax.bindings import (
    Binding,
    Bindings,
    How,
    bindings_of,
    is_class_method,
)
from composer.behavior_types.syntax.lineage import class_named
from composer.behavior_types.syntax.project_classes import ProjectClasses, takes_object
from composer.behavior_types.syntax.self_attributes import escapes, self_attributes
from composer.behavior_types.values import (
    NONE,
    ApiValue,
    Collection,
    OwnClass,
    OwnMethod,
    OwnObject,
    Parameters,
    Ports,
    Value,
)
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING, STRING
from composer.interfaces import Interfaces
from composer.model import Node, PortKind

if TYPE_CHECKING:
    from composer.behavior_types.call_sites import CallSites

#: ``self.publishers`` and the like.
CONTAINERS: Mapping[str, PortKind] = {
    "publishers": PortKind.PUBLISHER,
    "clients": PortKind.CLIENT,
    "action_clients": PortKind.ACTION_CLIENT,
}


#: How often types are inferred, until they rest on nothing that has changed.
_ROUNDS = 6


@dataclass()
class BehaviorTypes:
    """The types in the class of a behavior, used in one node."""

    node: Node
    source: BehaviorSource
    interfaces: Interfaces
    scopes: dict[int, FunctionTypes] = field(default_factory=dict)
    _known: dict[str, Value] = field(default_factory=dict)
    #: The types of attributes that methods of other classes assign, by class and name.
    of_objects: dict[tuple[int, str], Value] = field(default_factory=dict)
    #: The types of what functions without annotations return, by the id of the function.
    results: dict[int, Value] = field(default_factory=dict)
    depth: int = 0
    #: The parameters whose values ``on_configure`` refuses.
    refused: set[str] = field(default_factory=set)
    assumed: Assumed = field(default_factory=Assumed)
    _at_modules: dict[int, FunctionTypes] = field(default_factory=dict)
    _functions: dict[int, FunctionTypes] = field(default_factory=dict)

    def scope(self, method: Method, home: Module) -> FunctionTypes | None:
        """Return the types within a method; None if its syntax is not known."""
        if method.node is None:
            return None
        if id(method.node) not in self.scopes:
            bindings, arguments = bindings_of(method.node), self.arguments_of(method)
            self.scopes[id(method.node)] = FunctionTypes(
                self, home, bindings, arguments, function=method.node
            )
        return self.scopes[id(method.node)]

    def function(self, node: Function, home: Module, own: OwnClass | None = None) -> FunctionTypes:
        """Return the types within a function, or a method of ``own``, not of the behavior."""
        if id(node) not in self._functions:
            bindings = bindings_of(node, is_method=False)
            arguments: dict[str, Value] = {}
            positional = (*node.args.posonlyargs, *node.args.args)
            if own is not None and positional and positional[0].annotation is None:
                if takes_object(node):
                    is_object = self.project_classes.is_object(own)
                    arguments = {positional[0].arg: OwnObject(own)} if is_object else {}
                elif is_class_method(node):
                    arguments = {positional[0].arg: own}
            arguments |= self.inferred_arguments(node)
            self._functions[id(node)] = FunctionTypes(self, home, bindings, arguments, own, node)
        return self._functions[id(node)]

    def inferred_arguments(self, function: Function) -> dict[str, Value]:
        """Return the types of the arguments that all calls of a function pass."""
        return dict(self.assumed.arguments.get(id(function), {}))

    @cached_property
    def project_classes(self) -> ProjectClasses:
        """How the files of the behavior use their classes."""
        return ProjectClasses(self.source.own_modules)

    @cached_property
    def set_from_outside(self) -> frozenset[str]:
        """The attributes that the files set of objects other than ``self`` and messages."""
        return frozenset(set_from_outside(self))

    def parent(self, scope: FunctionTypes) -> Value:
        """Return the type of ``super()`` in a method; ANYTHING with several bases."""
        own = scope.of_class
        for home, known in self.source.classes if own is None else ():
            if any(self.scopes.get(id(method.node)) is scope for method in known.methods):
                own = OwnClass(known, home)
        if own is None or len(own.definition.bases) != 1:
            return ANYTHING
        derived = self.project_classes.derived(own)
        if any(len(item.definition.bases) > 1 for item in derived):
            return ANYTHING
        return self.parent_named(own.definition.node.bases[0], own.home)

    def parent_named(self, base: ast.expr, home: Module) -> Value:
        """Return the type of ``super()`` for a base class."""
        own = class_named(dotted(base), home)
        return OwnObject(own) if own is not None else ANYTHING

    def declared_value(self, call: ast.Call) -> Value:  # noqa: ARG002 - for HostedTypes
        """Return the type of the value of the parameter of rclpy that a call names."""
        return ANYTHING

    @cached_property
    def handlers(self) -> Mapping[str, Handler]:
        """The handlers of the node's ports and timers, by name."""
        return handlers_of(self.node, self.interfaces)

    @cached_property
    def self_attributes(self) -> frozenset[str]:
        """The attributes that the behavior may have, if its class is known completely."""
        declared = {
            statement.target.id
            for _, known in self.source.classes
            for statement in known.node.body
            if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name)
        }
        created = set_by_methods(self)
        assigned = {
            name
            for name, bindings in self.assigned.items()
            if (name not in declared or any(binding.creates for _, binding in bindings))
            and name in created
        }
        return self_attributes(self.source, assigned)

    @cached_property
    def self_escapes(self) -> bool:
        """Whether other code may set further attributes."""
        return escapes(self.source)

    def at_module(self, home: Module) -> FunctionTypes:
        """Return the types at the top level of a module."""
        if id(home.tree) not in self._at_modules:
            self._at_modules[id(home.tree)] = FunctionTypes(self, home, Bindings(), {})
        return self._at_modules[id(home.tree)]

    def infer(self) -> None:
        """Infer the types of all attributes, before expressions in methods ask for them.

        A type that rests on itself, as in ``self.count = self.count + 1``, is found only so.
        """
        for _ in range(_ROUNDS):
            self.infer_attributes()
            if not self.learn():
                break
            self.start_again()
        else:
            self.assumed = Assumed(is_settled=False)
            self.start_again()
            self.infer_attributes()

    def start_again(self) -> None:
        """Forget all types, and infer them again with what has been found."""
        self.forget()
        self.__dict__.pop("assigned", None)

    def infer_attributes(self) -> None:
        """Infer the types of all attributes, from what the last round has found."""
        for name in self.assigned:
            self.attribute(name)

    def learn(self) -> bool:
        """Return whether the types of arguments and elements have changed in this round."""
        before = self.assumed
        fillings = {
            name: filled(empty, self._fillings(name)) for name, empty in before.filled.items()
        }
        arguments = self.call_sites.arguments() if self.has_open_functions else {}
        self.assumed = Assumed(arguments, fillings)
        if self.assumed == Assumed(before.arguments, before.fillings):
            known = {name: without_none(found) for name, found in fillings.items()}
            self.assumed = Assumed(self.assumed.arguments, known)
            if known != fillings:
                self.start_again()
                self.infer_attributes()
            return False
        return True

    def _fillings(self, name: str) -> list[tuple[FunctionTypes, Filling]]:
        """Return what the methods put into ``self.<name>``, nothing if other code may as well."""
        return [(self.scopes[key], item) for key, item in self._all_fillings.get(name, ())]

    @cached_property
    def _all_fillings(self) -> dict[str, list[tuple[int, Filling]]]:
        """What the methods put into attributes, each with the id of the method."""
        found: dict[str, list[tuple[int, Filling]]] = {}
        passed_on: set[str] = set()
        for home, known in self.source.classes:
            for function in (method.node for method in known.methods if method.node is not None):
                inside = fillings_of(function, home)
                passed_on |= inside.passed_on
                for name, items in inside.found.items():
                    found.setdefault(name, []).extend((id(function), item) for item in items)
        return {
            name[1:]: items
            for name, items in found.items()
            if name.startswith(".") and name not in passed_on
        }

    @cached_property
    def call_sites(self) -> CallSites:
        """The calls of functions without annotations."""
        from composer.behavior_types.call_sites import CallSites  # noqa: PLC0415 (start-up time)

        return CallSites(self)

    @cached_property
    def has_open_functions(self) -> bool:
        """Whether the files have functions with parameters that have no annotation."""
        return any(
            is_open(function)
            for home in self.source.own_modules
            for functions in (
                home.tree.body,
                *((method.node for method in known.methods) for known in home.classes.values()),
            )
            for function in functions
            if isinstance(function, Function)
        )

    def forget(self) -> None:
        """Forget all types, since those of arguments have become known."""
        self.scopes.clear()
        self._known.clear()
        self.of_objects.clear()
        self._at_modules.clear()
        self._functions.clear()
        self.results.clear()

    def forget_expressions(self) -> None:
        """Forget the types of expressions, since one rests on an assumption that is wrong."""
        for scope in (*self.scopes.values(), *self._functions.values()):
            scope.forget()
        self.results.clear()

    def attribute(self, name: str) -> Value:
        """Return the type of ``self.<name>``."""
        if name not in self._known:
            self._known[name] = ANYTHING  # in case it is computed from itself
            self._known[name] = self._attribute(name)
        return self._known[name]

    def before_changes(self, name: str) -> Value:
        """Return the type of ``self.<name>`` without what '+=' and the like do to it."""
        places = self.assigned.get(name, ())
        return joined((scope.bound(binding), binding.how) for scope, binding in places)

    def annotation(self, name: str) -> Value:
        """Return the type that an annotation gives to ``self.<name>``, ANYTHING without one."""
        for scope, binding in self.assigned.get(name, ()):
            if binding.how is How.ANNOTATION:
                return scope.bound(binding)
        return ANYTHING

    def _attribute(self, name: str) -> Value:
        method = self.source.method(name)
        if method is not None and method.node is not None:
            home = self._home(method)
            if method.known and home is not None:
                return OwnMethod(method, home)
            scope = self.scope(method, home) if home is not None else None
            own = self._class_of(method)
            return (
                ANYTHING if scope is None or own is None else method_value(scope, method.node, own)
            )
        if name in self.assigned:
            return self._joined(name)
        return ANYTHING if method is not None else self.of_base(name)

    def of_base(self, name: str) -> Value:
        """Return the type of an attribute that the class does not set itself."""
        if name in CONTAINERS:
            return Ports(CONTAINERS[name])
        if name == "parameters":
            return Parameters()
        if name == "node":
            return rclpy_object("Node")
        api = attribute_class(name)
        known = STRING if name == "name" else ANYTHING
        return ApiValue(api) if api is not None else known

    def _joined(self, name: str) -> Value:
        """Return the type of an attribute that methods assign, also from its own old value."""
        plain: list[tuple[FunctionTypes, Binding]] = []
        computed: list[tuple[FunctionTypes, Binding]] = []
        for scope, binding in self.assigned[name]:
            of_itself = scope.reads_attribute(binding.expression, name)
            (computed if of_itself else plain).append((scope, binding))
        found = joined((scope.bound(binding), binding.how) for scope, binding in plain)
        if isinstance(found, Collection) and found.is_empty and self.assumed.is_settled:
            is_own = all(is_fresh(binding.expression) for _, binding in plain)
            if is_own and self._fillings(name) and not self.self_escapes:
                self.assumed.filled[name] = found
                found = self.assumed.fillings.get(name, Collection(found.python, NONE, NONE))
        self._known[name] = found
        computed = [pair for pair in computed if not lacks(found, pair[1].expression, name)]
        found = joined([(found, How.VALUE)] + [(s.bound(item), item.how) for s, item in computed])
        if found != self._known[name]:
            self.forget_expressions()
            self.of_objects.clear()
            return ANYTHING
        return with_changes(found, self._changes(name))

    def _changes(self, name: str) -> Iterator[tuple[ast.operator, Value]]:
        """Yield what ``+=`` and the like do to ``self.<name>``."""
        for scope in self.scopes.values():
            for operator, value in scope.bindings.changes.get(name, ()):
                yield operator, scope.type_of(value)

    @cached_property
    def assigned(self) -> dict[str, list[tuple[FunctionTypes, Binding]]]:
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
        own = self._class_of(method)
        return own.home if own is not None else None

    def _class_of(self, method: Method) -> OwnClass | None:
        classes = (OwnClass(known, home) for home, known in self.source.classes)
        return next((own for own in classes if own.definition.has(method)), None)

    def arguments_of(self, method: Method) -> Mapping[str, Value]:
        """Return the types of the arguments that the composer passes to a handler."""
        handler = self.handlers.get(method.name)
        given = dict(zip(method.arguments, handler.arguments if handler else (), strict=False))
        return self.inferred_arguments(method.node) | given if method.node is not None else given


def _of_class(node: ast.ClassDef) -> Iterator[tuple[str, Binding]]:
    """Yield the attributes that the body of a class assigns or declares."""
    for statement in node.body:
        match statement:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    if isinstance(target, ast.Name):
                        yield target.id, Binding(value)
            case ast.AnnAssign(target=ast.Name(id=name), annotation=annotation, value=value):
                is_set = value is not None
                yield name, Binding(annotation, How.ANNOTATION, creates=is_set, value=value)
