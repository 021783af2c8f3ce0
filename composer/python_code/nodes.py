"""The nodes of a system that run Python: behaviors with their handlers, and rclpy classes."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TypeAlias

from composer import behavior
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located
from composer.language.tree import is_opaque
from composer.model import Node, Port, PortKind, System
from composer.model.resolve.parameters import rclpy_type
from composer.project import Project
from composer.python_code.lookup import BehaviorSource, find_behavior
from composer.python_code.scopes import Scope
from composer.python_code.syntax import Method, scopes_in
from composer.python_code.trees import argument, span_of, walk

#: A node, and the source of its behavior or class.
NodeClass: TypeAlias = tuple[Node, BehaviorSource]
#: The classes that behaviors may import from ``composer.behavior``, with their attributes.
API_NAMES: Mapping[str, tuple[str, ...]] = {
    name: tuple(attribute for attribute in dir(item) if not attribute.startswith("_"))
    for name, item in vars(behavior).items()
    if isinstance(item, type) and item.__module__ == behavior.__name__
}
_PUBLISH = re.compile(r"self\.publishers\.(\w+)\.publish")
_DECLARING = frozenset({"declare_parameter", "declare_parameters"})
#: With one of these, parameters exist that the class does not declare by name.
_UNDECLARED = frozenset(
    {"allow_undeclared_parameters", "automatically_declare_parameters_from_overrides"}
    | {"get_parameters_by_prefix", "has_parameter"}
)
_GOAL = "composer.behavior.Goal[{0}.Goal, {0}.Feedback]"


@dataclass(frozen=True, slots=True)
class Signature:
    """The arguments of a handler by name, with their types, and the type of its result.

    ``{0}`` in a type stands for the interface of a port.
    """

    arguments: tuple[tuple[str, str], ...] = ()
    result: str = "None"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the arguments."""
        return tuple(name for name, _ in self.arguments)

    def of(self, interface: str) -> Signature:
        """Return the signature for a port with an interface, as Python names it."""
        arguments = tuple((name, type_.format(interface)) for name, type_ in self.arguments)
        return Signature(arguments, self.result.format(interface))


#: Handlers that every behavior may have.
GENERAL_HANDLERS: Mapping[str, Signature] = {
    "on_configure": Signature(),
    "on_activate": Signature(),
    "on_deactivate": Signature(),
    "on_cleanup": Signature(),
    "on_shutdown": Signature(),
    "on_error": Signature((("cause", "Exception"),)),
    "on_parameters": Signature((("changes", "composer.behavior.Changes"),)),
}
#: The handlers of a port, by the beginning of their names.
_PORT_HANDLERS: Mapping[PortKind, Mapping[str, Signature]] = {
    PortKind.SUBSCRIPTION: {"on_": Signature((("message", "{0}"),))},
    PortKind.SERVICE: {
        "on_": Signature((("request", "{0}.Request"), ("response", "{0}.Response")), "{0}.Response")
    },
    PortKind.ACTION_SERVER: {
        "on_": Signature((("goal", _GOAL),), "{0}.Result"),
        "accept_": Signature((("request", "{0}.Goal"),), "bool"),
    },
}


def node_classes(system: System) -> tuple[NodeClass, ...]:
    """Return every node with a behavior or a class, and its source; each class is read once."""
    read: dict[tuple[str, Path], BehaviorSource] = {}
    project_at = cache(Project.at)
    classes = []
    for node in system.nodes:
        hosted = node.hosted_class if node.external is None else None
        reference = node.behavior or (hosted.reference if hosted is not None else None)
        if reference is None or is_opaque(reference.text.value):
            continue
        if not (reference.module and reference.class_name):
            continue  # a rule reports it
        key = (reference.text.value, reference.folder)
        if key not in read:
            read[key] = find_behavior(reference, project_at)
        classes.append((node, read[key]))
    return tuple(classes)


@dataclass(frozen=True, slots=True)
class Handler:
    """A method that the behavior may define for a port or a timer.

    ``needed`` is true if the port or timer has no reaction of its own.
    """

    name: str
    of: Located[str]  # the port's or timer's name
    kind: str  # "subscription", "timer", ...
    signature: Signature
    needed: bool


def use_of(node: Node, source: BehaviorSource) -> tuple[object, ...]:
    """Return what a check of the Python code of a node depends on; equal uses are checked once."""
    place = (source.reference.text.value, source.reference.folder)
    if node.behavior is None:
        return place
    ports = tuple((port.kind, port.name.value, port.interface.value) for port in node.ports)
    parameters = tuple((item.name.value, item.type.value) for item in node.parameters)
    timers = tuple(timer.name.value for timer in node.timers)
    return (*place, node.complete, ports, parameters, timers)


def handlers(node: Node) -> Iterator[Handler]:
    """Yield the handlers for the ports and timers of a node."""
    for port in node.ports:
        for prefix, signature in _PORT_HANDLERS.get(port.kind, {}).items():
            needed = prefix == "on_" and _is_needed(port)
            yield Handler(f"{prefix}{port.name}", port.name, port.kind.value, signature, needed)
    for timer in node.timers:
        needed = timer.reaction is None
        yield Handler(f"on_{timer.name}", timer.name, "timer", Signature(), needed)


def _is_needed(port: Port) -> bool:
    if port.kind is PortKind.ACTION_SERVER and (port.result or port.feedback):
        return False
    return not port.reactions


def reached_methods(source: BehaviorSource, *methods: Method) -> Iterator[Method]:
    """Yield ``methods``, and the methods of their class that they call, directly or not."""
    pending, seen = list(methods), {method.name for method in methods}
    while pending:
        current = pending.pop()
        yield current
        for callee in called_methods(source, current):
            if callee.name not in seen:
                seen.add(callee.name)
                pending.append(callee)


def called_methods(source: BehaviorSource, method: Method) -> Iterator[Method]:
    """Yield those methods of its class that ``method`` itself calls at once."""
    for call in method.calls:
        is_own = call.name.startswith("self.") and not call.deferred
        callee = source.method(call.name.removeprefix("self.")) if is_own else None
        if callee is not None:
            yield callee


@dataclass(slots=True)
class DeclaredParameters:
    """The parameters that a class declares, by name; ``is_complete`` if there are no others.

    The type is None if the source does not show it, or if it may change.
    """

    types: dict[str, Located[str] | None]
    is_complete: bool


def declared_parameters(source: BehaviorSource) -> DeclaredParameters:
    """Return the parameters that a class declares by methods of Node."""
    nodes = [node for module in source.own_modules for node in walk(module.tree.body)]
    texts = [module.source.text for module in source.own_modules]
    is_open = any(name in text for name in _UNDECLARED for text in texts)
    # A method that is passed on, or called for another object, may declare anything.
    mentions = sum(isinstance(node, ast.Attribute) and node.attr in _DECLARING for node in nodes)
    parameters = DeclaredParameters({}, source.complete and source.class_found and not is_open)
    for scope, call, method in calls_on_self(source):
        if method in _DECLARING:
            mentions -= 1
            _declare(scope, call, method, parameters)
    parameters.is_complete = parameters.is_complete and mentions == 0
    return parameters


def _declare(scope: Scope, call: ast.Call, method: str, parameters: DeclaredParameters) -> None:
    """Add the parameters that a call declares."""
    prefix: str | None = ""
    items = [(argument(call, 0, "name"), argument(call, 1, "value"))]
    if method == "declare_parameters":
        prefix = scope.known(scope.text, argument(call, 0, "namespace"))
        listed = argument(call, 1, "parameters")
        pairs = listed.elts if isinstance(listed, ast.List | ast.Tuple) else [ast.Tuple(elts=[])]
        items = [_pair(item) for item in pairs]
    for name_node, default in items:
        name = scope.known(scope.text, name_node)
        if name is None or prefix is None:
            parameters.is_complete = False
            continue
        name = f"{prefix}.{name}" if prefix else name
        is_certain = name not in parameters.types and not _may_change(call)
        type_ = rclpy_type(scope.known(scope.literal, default)) if is_certain else None
        where = span_of(call, scope.source)
        parameters.types[name] = Located(type_, where) if type_ is not None else None


def _pair(item: ast.expr) -> tuple[ast.expr | None, ast.expr | None]:
    match item:
        case ast.Tuple(elts=[name, default, *_]):
            return name, default
        case ast.Tuple(elts=[name]):
            return name, None
    return None, None


def calls_on_self(source: BehaviorSource) -> Iterator[tuple[Scope, ast.Call, str]]:
    """Yield the calls of methods of the object in the methods of a class, with their names."""
    for scope in scopes_in(source.classes):
        for node in scope.nodes:
            match node:
                case ast.Call(func=ast.Attribute(value=ast.Name(id="self"), attr=name)):
                    yield scope, node, name


def _may_change(call: ast.Call) -> bool:
    """Return whether a declaration may allow values of several types."""
    match argument(call, 2, "descriptor"):
        case None:
            return False
        case ast.Call(keywords=keywords):
            return any(item.arg in (None, "dynamic_typing") for item in keywords)
    return True


def published_port(name: str) -> str | None:
    """Return ``x`` for ``self.publishers.x.publish``."""
    match = _PUBLISH.fullmatch(name)
    return match[1] if match else None
