"""The Python behaviours of a system, read as syntax, and the handlers they should have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from composer.analysis.context import Context, is_opaque
from composer.behavior_source import BehaviorSource, find_behavior
from composer.model import BehaviorReference, Node, Port, PortKind
from composer.source import Located

#: Handlers that every behaviour may have, and the arguments each is called with.
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


@dataclass(frozen=True, slots=True)
class Handler:
    """A method that a port or a timer may have in the behaviour.

    ``needed`` is true when nothing else says what is to happen.
    """

    name: str
    of: Located[str]  # the port's or timer's name
    kind: str  # "subscription", "timer", ...
    arguments: tuple[str, ...]
    needed: bool


def behaviors(context: Context) -> tuple[tuple[Node, BehaviorSource], ...]:
    """Return every node that names a behaviour, with what is known of it; each file read once."""
    read: dict[tuple[str, Path], BehaviorSource] = {}
    found = []
    for node in context.system.nodes:
        reference = node.behavior
        if reference is None or not _is_readable(reference):
            continue
        key = (reference.text.value, reference.folder)
        if key not in read:
            read[key] = find_behavior(reference)
        found.append((node, read[key]))
    return tuple(found)


def complete_behaviors(context: Context) -> Iterator[tuple[Node, BehaviorSource]]:
    """Yield the nodes whose behaviour is known down to its last method."""
    for node, source in context.once(behaviors):
        if source.class_found and source.complete and node.complete:
            yield node, source


def handlers(node: Node) -> Iterator[Handler]:
    """Yield the handlers that the ports and timers of a node may have."""
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


def _is_readable(reference: BehaviorReference) -> bool:
    """Say whether there is something to look for; no colon is the schema's to refuse."""
    return bool(reference.class_name) and not is_opaque(reference.text.value)
