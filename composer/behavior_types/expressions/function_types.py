"""Infers the types of the expressions in a function, without regard to the order of statements."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import TYPE_CHECKING

from composer.behavior_source import Function, Module, helper_named
from composer.behavior_source.method_body import dotted
from composer.behavior_types.expressions.annotations import annotated
from composer.behavior_types.expressions.displays import computed
from composer.behavior_types.expressions.fillings import filled, fillings_of, is_fresh, without_none
from composer.behavior_types.expressions.members import attribute_of
from composer.behavior_types.expressions.objects import unpacked_tuple, value_in_record
from composer.behavior_types.expressions.protocols import entered, item_of, iterated
from composer.behavior_types.expressions.rebinding import joined, with_changes
from composer.behavior_types.expressions.results import awaited, result_of
from composer.behavior_types.libraries.rclpy_api import rclpy_value
from composer.behavior_types.libraries.standard_types import NUMBERS, exception_type, sliced
from composer.behavior_types.scalars import is_text
from composer.behavior_types.syntax.bindings import Binding, Bindings, How, reads_attribute
from composer.behavior_types.syntax.lineage import class_named
from composer.behavior_types.syntax.literals import constant_type, integer_constant
from composer.behavior_types.syntax.module_names import hides
from composer.behavior_types.syntax.names import (
    constant_named,
    full_name,
    function_named,
    interface_name,
)
from composer.behavior_types.syntax.rebound_names import old_values
from composer.behavior_types.values import (
    NONE,
    ApiValue,
    Collection,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnModule,
    OwnObject,
    Parameters,
    Ports,
    Self,
    Value,
    join,
)
from composer.fast_dataclass import dataclass
from composer.field_types import (
    ANYTHING,
    NUMBER,
    STRING,
    fields_of,
)
from composer.interfaces import FieldType, Message

if TYPE_CHECKING:
    from composer.behavior_types.inference import BehaviorTypes

_SEVERAL = 2


@dataclass(slots=True)
class FunctionTypes:
    """The types of the expressions in one function."""

    owner: BehaviorTypes
    home: Module
    bindings: Bindings
    arguments: Mapping[str, Value]
    #: The class of the method, if it is not that of the behavior.
    of_class: OwnClass | None = None
    #: The function itself, if it is one.
    function: Function | None = None
    #: The shapes of arrays of numpy, by the id of the expression; checks fill it.
    shapes: dict[int, tuple[int | None, ...] | None] = field(default_factory=dict)
    _known: dict[int, Value] = field(default_factory=dict)
    _names: dict[str, Value] = field(default_factory=dict)
    #: The names that are not of the type that they have at first.
    _changing: set[str] = field(default_factory=set)
    _is_started: bool = False
    _old_values: dict[int, Binding] | None = None

    def type_of(self, node: ast.expr) -> Value:
        """Return the type of an expression, ANYTHING if it is unknown."""
        if not self._is_started:
            self._is_started = True
            for name in self.bindings.computed:  # before expressions within their values
                self.name(name)
        if id(node) not in self._known:
            self._known[id(node)] = ANYTHING
            self._known[id(node)] = self._infer(node)
        return self._known[id(node)]

    def bound(self, binding: Binding) -> Value:
        """Return the type that a binding gives to its name."""
        if binding.expression is None:
            return ANYTHING
        if binding.how is How.ANNOTATION:
            return self.annotated(binding.expression, self.home)
        if binding.how is How.EXCEPTION:
            own = self.type_of(binding.expression)
            if isinstance(own, OwnClass):
                return OwnObject(own)
            return exception_type(self.called_name(binding.expression))
        is_context = binding.how is How.CONTEXT
        found = (entered if is_context else FunctionTypes.type_of)(self, binding.expression)
        if binding.how is How.ELEMENT:
            found = self.element(found)
        for position in binding.positions:
            found = self._at(found, position)
        return found

    def forget(self) -> None:
        """Forget all types, since one of them rests on an assumption that is wrong."""
        self._known.clear()
        self.shapes.clear()
        self._names.clear()
        self._is_started = False

    def reads_attribute(self, node: ast.expr | None, name: str) -> bool:
        """Return whether an expression reads ``self.<name>``, also by names of the function."""
        receiver = self.bindings.receiver
        return any(
            reads_attribute(item, receiver, name) for item in self.bindings.expressions_of(node)
        )

    def global_name(self, name: str) -> str:
        """Return the full name of a dotted name that starts with an imported one, or ""."""
        head = name.partition(".")[0]
        return "" if self.is_local(head) else full_name(name, self.home)

    def called_name(self, function: ast.expr) -> str:
        """Return the full name of an imported or built-in function, or ""."""
        name = dotted(function)
        full = self.global_name(name) if name else ""
        first = "dict" if name == "dict.fromkeys" else name
        is_builtin = not full and first.isidentifier() and not self.is_local(first)
        is_builtin = is_builtin and not self.home.may_have(first)
        return name if is_builtin and first not in hides(self.home) else full

    def is_local(self, name: str) -> bool:
        """Return whether the function itself binds ``name``."""
        return name in self.bindings.names or name == self.bindings.receiver

    def _infer(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(value=value):
                return constant_type(value)
            case ast.JoinedStr():
                return STRING
            case ast.Name(id=name):
                only = self.bindings.uses.get(id(node)) or self._caught(node)
                only = only or self._old_value(node)
                return self.name(name) if only is None else self.bound(only)
            case ast.Attribute(value=value):
                name = dotted(node)
                found = self._global(name) if name else ANYTHING
                if found is ANYTHING and name in self.home.imports:  # import package.module
                    found = self._of_module(name)
                return (
                    attribute_of(self, self.type_of(value), node.attr)
                    if found is ANYTHING
                    else found
                )
            case ast.Call():
                return result_of(self, node)
            case ast.Await(value=value):
                return awaited(self.type_of(value))
            case ast.Subscript(value=value, slice=index):
                return self._item(self.type_of(value), index)
            case ast.IfExp(body=first, orelse=second):
                return join(self.type_of(first), self.type_of(second))
            case ast.NamedExpr(value=value):
                return self.type_of(value)
            case _:
                return computed(self, node)

    def _caught(self, node: ast.Name) -> Binding | None:
        """Return the ``except`` that a name is bound by, if several of them bind it."""
        bindings = self.bindings.of_name(node.id)
        if len(bindings) < _SEVERAL or any(item.how is not How.EXCEPTION for item in bindings):
            return None
        earlier = [
            item
            for item in bindings
            if item.expression is not None and item.expression.lineno <= node.lineno
        ]
        return earlier[-1] if earlier else None

    def _old_value(self, node: ast.Name) -> Binding | None:
        """Return what a name is bound to where its new value is computed from it."""
        if self._old_values is None:
            function = self.function if self.bindings.computed else None
            self._old_values = {} if function is None else old_values(function, self.bindings)
        return self._old_values.get(id(node))

    def name(self, name: str) -> Value:
        """Return the type of a name."""
        if name == self.bindings.receiver and name not in self.bindings.names:
            return Self()
        if name not in self._names:
            self._names[name] = ANYTHING
            self._names[name] = self._named(name)
        return self._names[name]

    def _named(self, name: str) -> Value:
        bindings = self.bindings.of_name(name)
        if not bindings:
            return self._of_module(name)
        if name in self.bindings.distinguished:
            return ANYTHING
        found = self._filled(name, self.before_changes(name))
        found = with_changes(
            found,
            ((op, self.type_of(value)) for op, value in self.bindings.name_changes.get(name, ())),
        )
        given = self.arguments.get(name)
        if given is None:
            return found
        if len(bindings) > 1:
            return found
        if found is ANYTHING or _compatible(found, given):
            return given
        # The annotation is reported; which of the two the function means is not known.
        return ANYTHING if isinstance(given, Message) else found

    def _filled(self, name: str, found: Value) -> Value:
        """Return the type of a name, with the elements that the function puts into it."""
        if self.function is None or not isinstance(found, Collection) or not found.is_empty:
            return found
        if not all(is_fresh(item.expression) for item in self.bindings.of_name(name)):
            return found
        known = fillings_of(self.function, self.home)
        fillings = known.found.get(name, ())
        if not fillings or name in known.passed_on:
            return found
        return without_none(filled(found, ((self, item) for item in fillings)))

    def before_changes(self, name: str) -> Value:
        """Return the type of a name of the function without what '+=' and the like do to it."""
        bindings = self.bindings.of_name(name)
        if name in self.bindings.computed and name not in self._changing:
            return self._computed(name, bindings, self.bindings.computed[name])
        return joined(self._bound_pairs(name, bindings))

    def _bound_pairs(self, name: str, bindings: list[Binding]) -> Iterator[tuple[Value, How]]:
        """Yield the types of bindings; the annotation of an argument says what it is at first."""
        is_argument = self.function is not None and name in arguments_of(self.function)
        for binding in bindings:
            is_first = is_argument and binding is bindings[0] and len(bindings) > 1
            yield self.bound(binding), How.VALUE if is_first else binding.how

    def _computed(self, name: str, bindings: list[Binding], computed: list[Binding]) -> Value:
        """Return the type of a name that is also computed from its own old value."""
        plain = [item for item in bindings if item not in computed]
        first = joined((self.bound(binding), binding.how) for binding in plain)
        if first is not NONE:
            self._names[name] = first
        found = joined(self._bound_pairs(name, bindings))
        if first in (NONE, found):
            return found
        self._changing.add(name)
        self.owner.forget_expressions()  # they rest on the first type
        return ANYTHING

    def _of_module(self, name: str) -> Value:
        """Return the type of a name that the function does not bind."""
        found = helper_named(name, self.home)
        return self._global(name) if found is None else self.of_helper(found.module, found.name)

    def of_helper(self, home: Module, name: str) -> Value:
        """Return the type of what ``name`` means in a file of the project; "" is the file."""
        if not name:
            return OwnModule(home)
        function = function_named(name, home)
        if function is not None:
            return ModuleFunction(function, home)
        constant = constant_named(name, home) if name not in home.classes else None
        if isinstance(constant, ast.Constant):
            return constant_type(constant.value)
        scope = self.owner.at_module(home)
        if isinstance(constant, ast.AnnAssign):
            return scope.annotated(constant.annotation, home)
        if constant is not None:
            return scope.type_of(constant)
        return class_named(name, home) or scope._global(name)

    def _global(self, dotted_name: str) -> Value:
        """Return the type of an imported name."""
        full = self.global_name(dotted_name)
        if full in NUMBERS:
            return NUMBER
        name, rest = interface_name(full)
        definition = self.owner.interfaces.find(name) if name and not rest else None
        return InterfaceClass(definition) if definition is not None else rclpy_value(full)

    def annotated(self, annotation: ast.expr, home: Module) -> Value:
        """Return the type that an annotation in ``home`` names."""
        return annotated(annotation, home, self.owner.node, self.owner.interfaces)

    def _item(self, owner: Value, index: ast.expr) -> Value:
        if isinstance(owner, Ports | Parameters):
            name = index.value if isinstance(index, ast.Constant) else None
            return attribute_of(self, owner, name) if isinstance(name, str) else ANYTHING
        if isinstance(index, ast.Slice):
            return sliced(owner)
        if isinstance(owner, OwnObject) and isinstance(index, ast.Constant):
            found = value_in_record(self, owner, index.value)
            return item_of(self, owner) if found is ANYTHING else found
        if isinstance(owner, OwnObject):
            return item_of(self, owner)
        if isinstance(owner, Collection):
            position = integer_constant(index)
            if owner.items is not None and position is not None:
                return self._at(owner, position)
            return ANYTHING if owner.python is set else owner.element
        return self.element(owner)

    def element(self, owner: Value) -> Value:
        """Return the type of what iterating over a value gives."""
        found = iterated(self, owner)
        return self.normal(found) if isinstance(found, FieldType) else found

    def _at(self, owner: Value, position: int) -> Value:
        """Return the type of the item at a position of what is unpacked."""
        owner = unpacked_tuple(self, owner)
        if isinstance(owner, Collection) and owner.items is not None:
            count = len(owner.items)
            return owner.items[position] if -count <= position < count else ANYTHING
        if is_text(owner):
            return ANYTHING  # it is hardly unpacked on purpose
        return self.element(owner)

    def normal(self, type_: FieldType) -> Value:
        """Return the message of a type that is one, so that equal types compare as equal."""
        return fields_of(type_, self.owner.interfaces) or type_


def arguments_of(function: Function) -> frozenset[str]:
    """Return the names of the arguments of a function."""
    arguments = function.args
    return frozenset(
        item.arg for item in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    )


def _compatible(annotation: Value, given: Value) -> bool:
    """Return whether what a handler gets agrees with its annotation; None for no annotation."""
    if isinstance(annotation, ApiValue) and isinstance(given, ApiValue):
        return annotation.class_name == given.class_name
    if isinstance(annotation, OwnObject) and isinstance(given, OwnObject):
        is_open = annotation.parameter is ANYTHING  # 'ServerGoalHandle' names no action
        return annotation.of == given.of and (is_open or annotation == given)
    return annotation == given
