"""Infers the types of the expressions in a function, without regard to the order of statements."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from composer.behavior_source import Function, Module
from composer.behavior_source.method_body import dotted
from composer.behavior_types.annotations import annotated
from composer.behavior_types.api_values import api_member, api_result, class_member
from composer.behavior_types.bindings import Binding, Bindings, How, nodes_of
from composer.behavior_types.names import (
    constant_named,
    full_name,
    function_named,
    imported_from,
    interface_name,
)
from composer.behavior_types.operators import (
    binary,
    builtin_call,
    comparison,
    element_of,
    unary,
)
from composer.behavior_types.own_classes import class_named
from composer.behavior_types.values import (
    NONE,
    ApiMethod,
    ApiValue,
    Collection,
    CollectionMethod,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    OwnObject,
    Parameters,
    Pending,
    Ports,
    Self,
    Value,
    join,
    join_all,
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
from composer.interfaces import FieldType, Message
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.behavior_types.inference import BehaviorTypes

_NO_ITEMS: dict[str, str] = {}
_VALUES, _KEYS = type(_NO_ITEMS.values()), type(_NO_ITEMS.keys())
_PORT_CLASSES = {
    PortKind.PUBLISHER: "Publisher",
    PortKind.CLIENT: "Client",
    PortKind.ACTION_CLIENT: "ActionClient",
}


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

    def called_name(self, function: ast.expr) -> str:
        """Return the full name of an imported or built-in function, or ""."""
        name = dotted(function)
        full = self.global_name(name) if name else ""
        is_builtin = not full and name.isidentifier() and not self.is_local(name)
        return name if is_builtin and not self.home.may_have(name) else full

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
                return self._computed(node)

    def _computed(self, node: ast.expr) -> Value:
        """Return the type of an operation, or of a collection."""
        match node:
            case ast.BinOp(left=left, op=operator, right=right):
                return binary(self.type_of(left), operator, self.type_of(right))
            case ast.UnaryOp(op=operator, operand=operand):
                return unary(operator, self.type_of(operand))
            case ast.Compare(left=left, ops=operators, comparators=others):
                return comparison(operators, [self.type_of(item) for item in (left, *others)])
            case ast.BoolOp(values=values):
                return join_all(self.type_of(value) for value in values)
            case ast.List(elts=items):
                return Collection(list, self._common(items))
            case ast.Tuple(elts=items):
                return Collection(tuple, self._common(items))
            case ast.Set(elts=items):
                return Collection(set, self._common(items))
            case ast.Dict(keys=keys, values=values):
                return Collection(dict, self._common(values), self._common(keys))
            case ast.ListComp(elt=item):
                return Collection(list, self.type_of(item))
            case ast.SetComp(elt=item):
                return Collection(set, self.type_of(item))
            case ast.DictComp(key=key, value=value):
                return Collection(dict, self.type_of(value), self.type_of(key))
            case _:
                return ANYTHING

    def _common(self, items: Iterable[ast.expr | None]) -> Value:
        """Return the type of all of the items, ANYTHING if they differ."""
        return join_all(ANYTHING if item is None else self.type_of(item) for item in items)

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
            return self._of_module(name)
        found = joined((self.bound(binding), binding.how) for binding in bindings)
        found = with_changes(
            found,
            ((op, self.type_of(value)) for op, value in self.bindings.name_changes.get(name, ())),
        )
        given = self.arguments.get(name)
        if given is None:
            return found
        only_argument = len(bindings) == 1
        return (
            given if only_argument and (found is ANYTHING or _compatible(found, given)) else found
        )

    def _of_module(self, name: str) -> Value:
        """Return the type of a name that the function does not bind."""
        function = function_named(name, self.home)
        if function is not None:
            return ModuleFunction(function, self.home)
        constant = constant_named(name, self.home)
        if constant is not None:
            return _constant(constant.value)
        return class_named(name, self.home) or self._of_helper(name) or self._global(name)

    def _of_helper(self, name: str) -> Value | None:
        """Return a function or class that is imported from another file of the project."""
        home, original = imported_from(name, self.home, self.owner.source.own_modules)
        if home is None:
            return None
        function = function_named(original, home)
        return ModuleFunction(function, home) if function else class_named(original, home)

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
                if parameter is None:
                    return ANYTHING
                choices = parameter.choices.value if parameter.choices is not None else ()
                return parameter_type(parameter.type.value, choices)
            case ApiValue():
                return api_member(owner, name, self.owner.interfaces)
            case InterfaceClass(definition=definition):
                return class_member(definition, name)
            case Collection():
                return CollectionMethod(owner, name)
            case OwnObject(of=of):
                return self._of_object(of, name)
            case Message() | FieldType():
                message = fields_of(owner, self.owner.interfaces)
                member = message.field(name) if message is not None else None
                return self._normal(member.type) if member is not None else ANYTHING
            case _:
                return ANYTHING

    def _of_object(self, of: OwnClass, name: str) -> Value:
        """Return the type of an attribute of an object, from methods and annotations."""
        for method in of.definition.methods:
            if method.name == name and method.node is not None:
                known = method.known and not method.node.decorator_list
                return ModuleFunction(method.node, of.home, is_bound=True) if known else ANYTHING
        for statement in of.definition.node.body:
            match statement:
                case ast.AnnAssign(target=ast.Name(id=found), annotation=annotation):
                    if found == name:
                        return self._annotated(annotation, of.home)
        return ANYTHING

    def _call(self, node: ast.Call) -> Value:
        match self.type_of(node.func):
            case InterfaceClass(definition=Message() as message):
                return message
            case ApiMethod(owner=owner, member=member):
                result = api_result(owner, member.name, self.owner.interfaces)
                return Pending(member.name, node, result) if member.is_async else result
            case OwnMethod(method=method, home=home) if method.node is not None:
                return self._returned(method.node, home, node)
            case ModuleFunction(node=function, home=home):
                return self._returned(function, home, node)
            case OwnClass() as own:
                return OwnObject(own)
            case CollectionMethod(owner=collection, name=name):
                return ANYTHING if len(node.args) > 1 else _collection_result(collection, name)
        full = self.called_name(node.func)
        return builtin_call(full, [self.type_of(item) for item in node.args]) if full else ANYTHING

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
        if isinstance(index, ast.Slice):
            return owner if isinstance(owner, Collection) else ANYTHING
        if isinstance(owner, Collection):
            return ANYTHING if owner.python is set else owner.element
        return self._element(owner)

    def _element(self, owner: Value) -> Value:
        found = element_of(owner)
        return self._normal(found) if isinstance(found, FieldType) else found

    def _normal(self, type_: FieldType) -> Value:
        """Return the message of a type that is one, so that equal types compare as equal."""
        return fields_of(type_, self.owner.interfaces) or type_


def joined(found: Iterable[tuple[Value, How]]) -> Value:
    """Return the type of a name with these bindings; an annotation decides."""
    pairs = list(found)
    for type_, how in pairs:
        if how is How.ANNOTATION:
            return type_
    result: Value = NONE
    for type_, _ in pairs:
        result = join(result, type_)
    return result


def with_changes(type_: Value, changes: Iterable[tuple[ast.operator, Value]]) -> Value:
    """Return the type of a name after ``+=`` and the like; ANYTHING if they may change it."""
    for operator, value in changes:
        if binary(type_, operator, value) != type_:
            return ANYTHING
    return type_


def _collection_result(owner: Collection, name: str) -> Value:
    match name:
        case "values" if owner.python is dict:
            return Collection(_VALUES, owner.element)
        case "keys" if owner.python is dict:
            return Collection(_KEYS, owner.key)
        case "get" | "pop":
            return owner.element
        case "copy":
            return owner
        case _:
            return ANYTHING


def _compatible(annotation: Value, given: Value) -> bool:
    """Return whether what a handler gets agrees with its annotation; None for no annotation."""
    if isinstance(annotation, ApiValue) and isinstance(given, ApiValue):
        return annotation.class_name == given.class_name
    return annotation == given


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
        case bytes():
            return Collection(bytes, INTEGER)
        case _:
            return ANYTHING
