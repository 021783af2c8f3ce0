"""Behaviors read as syntax: their handlers, calls and unbound methods."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping

from composer import behavior
from composer.fast_dataclass import dataclass
from composer.model import Node, Port, PortKind
from composer.python_code.source import BehaviorSource, Method
from composer.source import Located

#: The classes that behaviors may import from ``composer.behavior``.
API_CLASSES = frozenset(
    name
    for name, item in vars(behavior).items()
    if isinstance(item, type) and item.__module__ == behavior.__name__
)
#: Handlers that every behavior may have, with the arguments they are called with.
GENERAL_HANDLERS: Mapping[str, tuple[str, ...]] = {
    "on_configure": (),
    "on_activate": (),
    "on_deactivate": (),
    "on_cleanup": (),
    "on_shutdown": (),
    "on_error": ("cause",),
    "on_parameters": ("changes",),
}

_ARGUMENTS: Mapping[PortKind, tuple[str, ...]] = {
    PortKind.SUBSCRIPTION: ("message",),
    PortKind.SERVICE: ("request", "response"),
    PortKind.ACTION_SERVER: ("goal",),
}


_PREFIXES = ("on_", "accept_")


@dataclass(frozen=True, slots=True)
class Handler:
    """A method that the behavior may define for a port or a timer.

    ``needed`` is true if the port or timer has no reaction of its own.
    """

    name: str
    of: Located[str]  # the port's or timer's name
    kind: str  # "subscription", "timer", ...
    arguments: tuple[str, ...]
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
        arguments = _ARGUMENTS.get(port.kind)
        if arguments is None:
            continue
        yield Handler(f"on_{port.name}", port.name, port.kind.value, arguments, _is_needed(port))
        if port.kind is PortKind.ACTION_SERVER:
            yield Handler(f"accept_{port.name}", port.name, port.kind.value, ("request",), False)
    for timer in node.timers:
        needed = timer.reaction is None
        yield Handler(f"on_{timer.name}", timer.name, "timer", (), needed)


def _is_needed(port: Port) -> bool:
    if port.kind is PortKind.ACTION_SERVER and (port.result or port.feedback):
        return False
    return not port.reactions


def unbound_handlers(node: Node, source: BehaviorSource) -> list[Method]:
    """Return the methods called ``on_...`` or ``accept_...`` that nothing calls.

    One that the code itself uses, such as ``on_feedback=self.on_progress``, is not a handler.
    """
    called = {handler.name for handler in handlers(node)} | GENERAL_HANDLERS.keys()
    unbound = [
        method
        for method in source.methods
        if method.name.startswith(_PREFIXES) and method.name not in called
    ]
    if not unbound:
        return []
    used = {
        inner.attr
        for module in source.own_modules
        for inner in ast.walk(module.tree)
        if isinstance(inner, ast.Attribute)
    }
    return [method for method in unbound if method.name not in used]


def reached_methods(source: BehaviorSource, *methods: Method) -> Iterator[Method]:
    """Yield ``methods`` and those of their class that they call, directly or through others."""
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
