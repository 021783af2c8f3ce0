"""Infers the types in a class that is derived from rclpy's ``Node``."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cached_property

from composer.behavior_source import BehaviorSource, Method, Module
from composer.behavior_source.method_body import argument
from composer.behavior_source.traversal import walk
from composer.behavior_types.assumptions import Assumed
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.members import attribute_of
from composer.behavior_types.expressions.objects import annotation_in, given_class
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.libraries.handlers import Handler
from composer.behavior_types.libraries.rclpy_api import is_rclpy, rclpy_class, rclpy_object
from composer.behavior_types.outside_assignments import set_by_methods
from composer.behavior_types.syntax.bindings import Bindings, nodes_of
from composer.behavior_types.syntax.literals import constant_type
from composer.behavior_types.syntax.names import own_name
from composer.behavior_types.syntax.own_classes import known_attributes
from composer.behavior_types.syntax.self_attributes import (
    ATTRIBUTES_OF_OBJECTS,
    class_attributes,
    escapes,
)
from composer.behavior_types.values import (
    NONE,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    OwnObject,
    Value,
    join,
)
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING

#: How often types are inferred: those of a callback's arguments determine those of further ones.
_ROUNDS = 3
_TRANSITIONS = ("configure", "activate", "deactivate", "cleanup", "shutdown", "error")
#: Attributes of Node that are not public, but that classes use.
_PRIVATE = frozenset(
    {
        *("_allow_undeclared_parameters", "_clients", "_clock", "_context", "_descriptors"),
        *("_default_callback_group", "_guards", "_logger", "_logger_service"),
        *("_managed_entities", "_on_set_parameters_callbacks", "_parameter_event_publisher"),
        *("_parameter_overrides", "_parameter_service", "_parameters", "_publishers"),
        *("_post_set_parameters_callbacks", "_pre_set_parameters_callbacks", "_rate_group"),
        *("_services", "_set_parameters_atomically", "_state_machine", "_subscriptions"),
        *("_time_source", "_timers", "_type_description_service", "_wake_executor"),
        *("_callbacks", "_validate_qos_or_depth_parameter", "_validate_topic_or_service_name"),
    }
)


@dataclass(frozen=True, slots=True)
class Callback:
    """A function that a call gives to rclpy, and how rclpy calls it.

    If ``gets_info``, rclpy passes a dict about the message as well, to a function that takes it.
    """

    node: ast.expr
    scope: FunctionTypes
    handler: Handler
    parameter: str
    gets_info: bool = False


class HostedTypes(BehaviorTypes):
    """The types in the class of a node that is not a behavior."""

    @cached_property
    def bases(self) -> tuple[OwnClass, ...]:
        """The classes of rclpy that the class is derived from."""
        found: list[OwnClass] = []
        for home, known in self.source.classes:
            for base in known.node.bases:
                own = rclpy_class(own_name(base, home))
                if own is not None and own not in found:
                    found.append(own)
        if any(own.definition.name == "LifecycleNode" for own in found):
            node = rclpy_class("rclpy.node.Node")
            found += [node] if node is not None and node not in found else []
        return tuple(found)

    @cached_property
    def is_lifecycle(self) -> bool:
        """Whether the class is a LifecycleNode."""
        return any(own.definition.name == "LifecycleNode" for own in self.bases)

    def parent_named(self, base: ast.expr, home: Module) -> Value:
        """Return the type of ``super()`` for a base class, also for one of rclpy."""
        own = rclpy_class(own_name(base, home))
        return OwnObject(own) if own is not None else super().parent_named(base, home)

    @cached_property
    def handlers(self) -> Mapping[str, Handler]:
        """The callbacks of the class, by name; filled by :meth:`infer`."""
        return self._transitions()

    @cached_property
    def lambdas(self) -> Mapping[int, Mapping[str, Value]]:
        """The arguments of the lambdas that a method passes to rclpy, by the id of the method."""
        return {}

    def arguments_of(self, method: Method) -> Mapping[str, Value]:
        """Return the types of the arguments of a callback, and of the lambdas in a method."""
        return {**self.lambdas.get(id(method.node), {}), **super().arguments_of(method)}

    @cached_property
    def self_attributes(self) -> frozenset[str]:
        """The attributes that an object of the class may have."""
        of_node = {*_PRIVATE} if self.bases else set()
        for own in self.bases:
            of_node |= known_attributes(own) or set()
        assigned = set_by_methods(self)
        return frozenset(ATTRIBUTES_OF_OBJECTS | of_node) | class_attributes(self.source, assigned)

    @cached_property
    def self_escapes(self) -> bool:
        """Whether other code than that of ROS may set further attributes."""
        return passes_node_on(self.source)

    def infer(self) -> None:
        """Infer the types of all attributes, and of what rclpy passes to callbacks."""
        for _ in range(_ROUNDS):
            super().infer()
            found = self._transitions() | self._callbacks_by_name()
            lambdas = self._lambda_arguments()
            if found == self.handlers and lambdas == self.lambdas:
                return
            self.handlers, self.lambdas = found, lambdas
            self.assumed = Assumed()
            self.start_again()
        super().infer()

    def of_base(self, name: str) -> Value:
        """Return the type of an attribute of rclpy's class."""
        for own in self.bases:
            found = attribute_of(self._at_base, OwnObject(own), name)
            if found is not ANYTHING:
                return found
        return ANYTHING

    @cached_property
    def _at_base(self) -> FunctionTypes:
        return FunctionTypes(self, self.bases[0].home, Bindings(), {})

    def declared_value(self, call: ast.Call) -> Value:
        """Return the type of the value of a parameter, from the default it is declared with."""
        name = argument(call, 0, "name")
        known = name.value if isinstance(name, ast.Constant) else None
        return self._declared.get(known, ANYTHING)

    @cached_property
    def _declared(self) -> Mapping[object, Value]:
        """The types of the values of parameters that are declared once, by name."""
        found: dict[object, Value] = {}
        for home in self.source.own_modules:
            for node in walk(home.tree.body):
                match node:
                    case ast.Call(func=ast.Attribute(attr="declare_parameter")):
                        name, value = argument(node, 0, "name"), argument(node, 1, "value")
                        if isinstance(name, ast.Constant):
                            known = found.get(name.value, NONE)
                            found[name.value] = join(known, _of_default(value))
                    case ast.Tuple(elts=[ast.Constant(value=str() as text), value, *_]):
                        found.setdefault(text, _of_default(value))
        return {name: type_ for name, type_ in found.items() if type_ is not NONE}

    def callbacks(self) -> Iterator[Callback]:
        """Yield the functions that the class gives to rclpy."""
        for home, known in self.source.classes:
            for method in known.methods:
                scope = self.scope(method, home)
                if scope is not None and method.node is not None:
                    for node in nodes_of(method.node):
                        if isinstance(node, ast.Call):
                            yield from callbacks_of(node, scope)

    def is_transition(self, name: str) -> bool:
        """Return whether a method handles a transition of a LifecycleNode."""
        return self.is_lifecycle and name.removeprefix("on_") in _TRANSITIONS

    def _callbacks_by_name(self) -> dict[str, Handler]:
        found: dict[str, Handler] = {}
        for callback in self.callbacks():
            value = callback.scope.type_of(callback.node)
            if isinstance(value, OwnMethod):
                name = value.method.name
                known = found.get(name, callback.handler)
                found[name] = known if known == callback.handler else Handler((), ANYTHING)
        return found

    def _lambda_arguments(self) -> dict[int, dict[str, Value]]:
        found: dict[int, dict[str, Value]] = {}
        methods = {id(scope): key for key, scope in self.scopes.items()}
        for callback in self.callbacks():
            if isinstance(callback.node, ast.Lambda):
                names = [item.arg for item in callback.node.args.args]
                given = dict(zip(names, callback.handler.arguments, strict=False))
                found.setdefault(methods[id(callback.scope)], {}).update(given)
        return found

    def _transitions(self) -> dict[str, Handler]:
        if not self.is_lifecycle:
            return {}
        state = rclpy_object("LifecycleState")
        handler = Handler((state,), rclpy_object("TransitionCallbackReturn"))
        return {f"on_{name}": handler for name in _TRANSITIONS}


def rclpy_function(call: ast.Call, scope: FunctionTypes) -> ModuleFunction | None:
    """Return the method or the constructor of rclpy that a call calls, None for other calls.

    Its parameter is the interface that the call is about.
    """
    called = scope.type_of(call.func)
    if not isinstance(called, ModuleFunction | OwnClass) or not is_rclpy(called.home):
        return None
    if isinstance(called, ModuleFunction):
        if called.parameter is not ANYTHING:
            return called
        function = called.node
    else:
        methods = {method.name: method.node for method in called.definition.methods}
        constructor = methods.get("__init__")
        if constructor is None:
            return None
        function = constructor
    parameter = given_class(scope, function, call, is_bound=True)
    return ModuleFunction(function, called.home, is_bound=True, parameter=parameter)


def callbacks_of(call: ast.Call, scope: FunctionTypes) -> Iterator[Callback]:
    """Yield the functions that a call gives to rclpy."""
    found = rclpy_function(call, scope)
    if found is None:
        return
    function, parameter, home = found.node, found.parameter, found.home
    positional = function.args.args[1:]
    given = dict(zip((item.arg for item in positional), call.args, strict=False))
    given.update({item.arg: item.value for item in call.keywords if item.arg is not None})
    for taken in (*positional, *function.args.kwonlyargs):
        match taken.annotation:
            case ast.Subscript(
                value=ast.Name(id="Callable"), slice=ast.Tuple(elts=[ast.List(elts=takes), gives])
            ) if taken.arg in given:
                types = tuple(annotation_in(scope, item, home, parameter) for item in takes)
                if "raw" in given:  # the message may be bytes
                    types = (ANYTHING,)
                result = annotation_in(scope, gives, home, parameter)
                handler = Handler(types, result)
                gets_info = function.name == "create_subscription"
                yield Callback(given[taken.arg], scope, handler, taken.arg, gets_info)


def _of_default(value: ast.expr | None) -> Value:
    """Return the type of a parameter with that default; rclpy does not let it change."""
    return constant_type(value.value) if isinstance(value, ast.Constant) else ANYTHING


def passes_node_on(source: BehaviorSource) -> bool:
    """Return whether a class passes its object to other code than that of ROS."""
    return escapes(source, _takes_nodes)


def _takes_nodes(full: str) -> bool:
    """Return whether a function or class of ROS takes a node, and does not set attributes of it."""
    return full.partition(".")[0] in {"message_filters", "rclpy", "tf2_ros"}
