"""Infers the types of the expressions in a behavior, without regard to the order of statements."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property

from composer.behavior_source import BehaviorSource, Method, Module
from composer.behavior_source.method_body import Function, dotted
from composer.behavior_types.annotations import annotated
from composer.behavior_types.api import attribute_class, members
from composer.behavior_types.bindings import Binding, Bindings, How, bindings_of, nodes_of
from composer.behavior_types.names import full_name, function_named, interface_name
from composer.behavior_types.self_attributes import escapes, self_attributes
from composer.behavior_types.values import (
    NONE,
    ApiMethod,
    ApiValue,
    InterfaceClass,
    ModuleFunction,
    OwnMethod,
    Parameters,
    Pending,
    Ports,
    Self,
    Value,
    join,
)
from composer.fast_dataclass import dataclass
from composer.field_types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STRING,
    fields_of,
    parameter_type,
)
from composer.interfaces import Action, FieldType, Interfaces, Message, Service
from composer.model import Node, PortKind

#: ``self.publishers`` and the like.
CONTAINERS: Mapping[str, PortKind] = {
    "publishers": PortKind.PUBLISHER,
    "clients": PortKind.CLIENT,
    "action_clients": PortKind.ACTION_CLIENT,
}
_PORT_CLASSES = {
    PortKind.PUBLISHER: "Publisher",
    PortKind.CLIENT: "Client",
    PortKind.ACTION_CLIENT: "ActionClient",
}
_CONVERSIONS = {"str": STRING, "int": INTEGER, "len": INTEGER, "float": NUMBER, "bool": BOOL}
_ANNOTATIONS: Mapping[str, Value] = {
    "str": STRING,
    "bool": BOOL,
    "float": NUMBER,
    "None": NONE,
}
_TIME = "builtin_interfaces/msg/Time"


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
        return self_attributes(self.source, self._assigned)

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

    def _attribute(self, name: str) -> Value:
        method = self.source.method(name)
        if method is not None:
            home = self._home(method)
            return OwnMethod(method, home) if method.known and home is not None else ANYTHING
        bindings = self._assigned.get(name, [])
        if any(name in scope.bindings.augmented for scope in self.scopes.values()):
            return ANYTHING
        if bindings:
            return _joined((scope.bound(binding), binding.how) for scope, binding in bindings)
        if name in CONTAINERS:
            return Ports(CONTAINERS[name])
        if name == "parameters":
            return Parameters()
        api = attribute_class(name)
        return ApiValue(api) if api is not None else ANYTHING

    @cached_property
    def _assigned(self) -> dict[str, list[tuple[FunctionTypes, Binding]]]:
        """The bindings of the attributes of ``self``."""
        assigned: dict[str, list[tuple[FunctionTypes, Binding]]] = {}
        for home, known in self.source.classes:
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


def handler_arguments(node: Node, interfaces: Interfaces) -> Mapping[str, tuple[Value, ...]]:
    """Return the types of the arguments of the handlers of a node's ports."""
    found: dict[str, tuple[Value, ...]] = {}
    for port in node.ports:
        name = port.name.value
        match port.kind, interfaces.find(port.interface.value):
            case PortKind.SUBSCRIPTION, Message() as message:
                found[f"on_{name}"] = (message,)
            case PortKind.SERVICE, Service() as service:
                found[f"on_{name}"] = (service.request, service.response)
            case PortKind.ACTION_SERVER, Action() as action:
                found[f"on_{name}"] = (ApiValue("Goal", port),)
                found[f"accept_{name}"] = (action.goal,)
    return found


@dataclass(slots=True)
class FunctionTypes:
    """The types of the expressions in one function."""

    owner: BehaviorTypes
    home: Module
    bindings: Bindings
    arguments: Mapping[str, Value]
    _known: dict[int, Value] = field(default_factory=dict)
    _names: dict[str, Value] = field(default_factory=dict)

    def type_of(self, node: ast.expr) -> Value:
        """Return the type of an expression, ANYTHING if it is unknown."""
        if id(node) not in self._known:
            self._known[id(node)] = ANYTHING
            self._known[id(node)] = self._infer(node)
        return self._known[id(node)]

    def bound(self, binding: Binding) -> Value:
        """Return the type that a binding gives to its name."""
        if binding.expression is None:
            return ANYTHING
        if binding.how is How.ANNOTATION:
            return self._annotated(binding.expression, self.home)
        found = self.type_of(binding.expression)
        return found if binding.how is How.VALUE else self._element(found)

    def global_name(self, name: str) -> str:
        """Return the full name of a dotted name that starts with an imported one, or ""."""
        head = name.partition(".")[0]
        return "" if self.is_local(head) else full_name(name, self.home)

    def is_local(self, name: str) -> bool:
        """Return whether the function itself binds ``name``."""
        return name in self.bindings.names or name == self.bindings.receiver

    def _infer(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(value=value):
                return _constant(value)
            case ast.JoinedStr():
                return STRING
            case ast.Name(id=name):
                return self.name(name)
            case ast.Attribute(value=value, attr=name):
                found = self._global(dotted(node))
                return self.member(self.type_of(value), name) if found is ANYTHING else found
            case ast.Call():
                return self._call(node)
            case ast.Await(value=value):
                awaited = self.type_of(value)
                return awaited.result if isinstance(awaited, Pending) else ANYTHING
            case ast.Subscript(value=value, slice=index):
                return self._item(self.type_of(value), index)
            case ast.IfExp(body=first, orelse=second):
                return join(self.type_of(first), self.type_of(second))
            case ast.NamedExpr(value=value):
                return self.type_of(value)
            case _:
                return ANYTHING

    def name(self, name: str) -> Value:
        """Return the type of a name."""
        if name == self.bindings.receiver and name not in self.bindings.names:
            return Self()
        if name not in self._names:
            self._names[name] = ANYTHING
            self._names[name] = self._named(name)
        return self._names[name]

    def _named(self, name: str) -> Value:
        bindings = self.bindings.names.get(name)
        if bindings is None:
            function = function_named(name, self.home)
            return ModuleFunction(function, self.home) if function else self._global(name)
        found = _joined((self.bound(binding), binding.how) for binding in bindings)
        given = self.arguments.get(name)
        if given is None:
            return found
        only_argument = len(bindings) == 1
        return (
            given if only_argument and (found is ANYTHING or _compatible(found, given)) else found
        )

    def _global(self, dotted_name: str) -> Value:
        """Return the type of an imported name."""
        full = self.global_name(dotted_name)
        name, rest = interface_name(full)
        definition = self.owner.interfaces.find(name) if name and not rest else None
        return InterfaceClass(definition) if definition is not None else ANYTHING

    def member(self, owner: Value, name: str) -> Value:
        """Return the type of attribute ``name`` of a value."""
        match owner:
            case Self():
                return self.owner.attribute(name)
            case Ports(kind=kind):
                port = self.owner.node.port(name)
                found = port is not None and port.kind is kind
                return ApiValue(_PORT_CLASSES[kind], port) if found else ANYTHING
            case Parameters():
                parameter = self.owner.node.parameter(name)
                return ANYTHING if parameter is None else parameter_type(parameter.type.value)
            case ApiValue():
                return self._api_member(owner, name)
            case InterfaceClass(definition=definition):
                return _nested_class(definition, name)
            case Message() | FieldType():
                message = fields_of(owner, self.owner.interfaces)
                member = message.field(name) if message is not None else None
                return self._normal(member.type) if member is not None else ANYTHING
            case _:
                return ANYTHING

    def _api_member(self, owner: ApiValue, name: str) -> Value:
        member = members(owner.class_name).get(name)
        if member is None:
            return ANYTHING
        return ApiMethod(owner, member) if member.is_method else self._result(owner, name)

    def _result(self, owner: ApiValue, name: str) -> Value:
        """Return the type of a property, or of what a method returns."""
        definition = self.owner.interfaces.find(owner.port.interface.value) if owner.port else None
        match owner.class_name, name, definition:
            case "Publisher", "message_type", Message() as message:
                return InterfaceClass(message)
            case "Client", "service_type", Service() as service:
                return InterfaceClass(service)
            case "Client", "call", Service() as service:
                return service.response
            case "ActionClient", "action_type", Action() as action:
                return InterfaceClass(action)
            case "GoalResult", "result", Action() as action:
                return action.result
            case "Goal", "request", Action() as action:
                return action.goal
            case "Clock", "stamp", _:
                return self.owner.interfaces.message(_TIME) or ANYTHING
        annotation = members(owner.class_name)[name].annotation
        if annotation in {"SentGoal", "GoalResult"}:
            return ApiValue(annotation, owner.port)
        return _ANNOTATIONS.get(annotation, ANYTHING)

    def _call(self, node: ast.Call) -> Value:
        match self.type_of(node.func):
            case InterfaceClass(definition=Message() as message):
                return message
            case ApiMethod(owner=owner, member=member):
                result = self._result(owner, member.name)
                return Pending(member.name, node, result) if member.is_async else result
            case OwnMethod(method=method, home=home) if method.node is not None:
                return self._returned(method.node, home, node)
            case ModuleFunction(node=function, home=home):
                return self._returned(function, home, node)
        if isinstance(node.func, ast.Name) and not self.is_local(node.func.id):
            builtin = _CONVERSIONS.get(node.func.id, ANYTHING)
            return builtin if node.func.id not in self.home.imports else ANYTHING
        return ANYTHING

    def _returned(self, function: Function, home: Module, call: ast.Call) -> Value:
        """Return the type of a call of a function; only annotations determine it."""
        result: Value = ANYTHING
        if function.returns is not None:
            result = self._annotated(function.returns, home)
        if not isinstance(function, ast.AsyncFunctionDef):
            return result
        is_plain = not function.decorator_list and not any(
            isinstance(inner, ast.Yield) for inner in nodes_of(function)
        )
        return Pending(function.name, call, result) if is_plain else ANYTHING

    def _annotated(self, annotation: ast.expr, home: Module) -> Value:
        return annotated(annotation, home, self.owner.node, self.owner.interfaces)

    def _item(self, owner: Value, index: ast.expr) -> Value:
        if isinstance(owner, Ports | Parameters):
            name = index.value if isinstance(index, ast.Constant) else None
            return self.member(owner, name) if isinstance(name, str) else ANYTHING
        return ANYTHING if isinstance(index, ast.Slice) else self._element(owner)

    def _element(self, owner: Value) -> Value:
        if isinstance(owner, FieldType) and owner.is_array:
            return self._normal(owner.element)
        return ANYTHING

    def _normal(self, type_: FieldType) -> Value:
        """Return the message of a type that is one, so that equal types compare as equal."""
        return fields_of(type_, self.owner.interfaces) or type_


def _joined(found: Iterable[tuple[Value, How]]) -> Value:
    """Return the type of a name with these bindings; an annotation decides."""
    pairs = list(found)
    for type_, how in pairs:
        if how is How.ANNOTATION:
            return type_
    result: Value = NONE
    for type_, _ in pairs:
        result = join(result, type_)
    return result


def _compatible(annotation: Value, given: Value) -> bool:
    """Return whether what a handler gets agrees with its annotation; None for no annotation."""
    if isinstance(annotation, ApiValue) and isinstance(given, ApiValue):
        return annotation.class_name == given.class_name
    return annotation == given


def _nested_class(definition: Message | Service | Action, name: str) -> Value:
    part = None
    if isinstance(definition, Service) and name in {"Request", "Response"}:
        part = definition.request if name == "Request" else definition.response
    if isinstance(definition, Action) and name in {"Goal", "Result", "Feedback"}:
        part = getattr(definition, name.lower())
    return InterfaceClass(part) if isinstance(part, Message) else ANYTHING


def _constant(value: object) -> Value:
    match value:
        case None:
            return NONE
        case bool():
            return BOOL
        case int():
            return INTEGER
        case float():
            return NUMBER
        case str():
            return STRING
        case _:
            return ANYTHING
