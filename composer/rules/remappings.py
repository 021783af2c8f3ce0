"""Remappings: names that no port has, collisions, and connections that take precedence."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Severity,
    Subject,
    error,
    shown,
    suggestion,
    warning,
)
from composer.base.spelling import misspelled
from composer.language.rules import MAX_ERRORS
from composer.model import ImplementationKind, Node, Port, PortKind, Remapping
from composer.model.names import expand_name, remapped_name, topic_name_problem
from composer.model.node import TOOL_SERVICES
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.subjects import wiring

UNKNOWN_REMAPPING = error("RC208", "unknown-remapping")
REMAPPING_COLLISION = warning("RC226", "remapping-collision")
UNUSED_REMAPPING = warning("RC241", "unused-remapping")
_Ports = Mapping[str, Sequence[Port]]
_RULE_IF_PASSED_ON = replace(UNKNOWN_REMAPPING, severity=Severity.INFO)
#: Topics and services that every ROS node has without declaring them.
_OF_EVERY_NODE = frozenset(("/clock", "/diagnostics", "/parameter_events", "/rosout"))
#: The same, in the namespace with the name of the node.
_PRIVATE_OF_EVERY_NODE = frozenset((*TOOL_SERVICES, "transition_event"))
_NAMES_IN_CODE = (
    ImplementationKind.CLASS,
    ImplementationKind.EXECUTABLE,
    ImplementationKind.COMPONENT,
)


def own_name(node: Node, name: str) -> str:
    """Return the full name of ``name`` in ``node`` before remapping."""
    return expand_name(name, node.ros_name.value, node.namespace.value)


def _ports_by_name(node: Node) -> _Ports:
    """Return the ports by their full names before remapping."""
    ports: dict[str, list[Port]] = defaultdict(list)
    for port in node.all_ports if node.remappings else ():
        ports[own_name(node, port.ros_name.value)].append(port)
    return ports


def _matched_ports(node: Node, ports: _Ports, remapping: Remapping) -> Sequence[Port]:
    """Return the ports whose declared name the remapping replaces."""
    return ports.get(own_name(node, remapped_name(remapping.source.value)), ())


def check_unknown_remapping(context: Context) -> Iterator[Diagnostic]:
    """Check the name that each remapping replaces."""
    compared = 0  # each takes a millisecond if there are many names
    for node in context.system.nodes:
        if not node.complete or any(is_unresolved(port.ros_name.value) for port in node.ports):
            continue
        ports = _ports_by_name(node)
        names = tuple(port.ros_name.value for port in node.ports)
        for remapping in node.remappings:
            source = remapping.source
            if _is_known(node, ports, remapping):
                continue
            compared += 1
            if node.gets_undeclared and (
                compared > MAX_ERRORS or misspelled(source.value, names) is None
            ):
                continue
            yield Diagnostic(
                _RULE_IF_PASSED_ON if node.gets_undeclared else UNKNOWN_REMAPPING,
                f"node '{node.name}' has no port named '{source}' to remap",
                source.span,
                hint=_remapping_hint(node, source.value, names),
                subjects=() if node.gets_undeclared else tuple(_names_meant(node, remapping)),
            )


def _names_meant(node: Node, remapping: Remapping) -> Iterator[Subject]:
    """Yield what is not known if a remapping names no port: any port of the node may be meant."""
    yield ("name", own_name(node, remapping.target.value))
    for port in node.ports:
        yield from wiring(node, port)


def _is_known(node: Node, ports: _Ports, remapping: Remapping) -> bool:
    source = remapping.source.value
    if is_unresolved(source) or topic_name_problem(source) is not None:
        return True  # cannot be checked, or is reported by another rule
    full_name = own_name(node, source)
    folder, _, name = full_name.rpartition("/")
    return (
        full_name in _OF_EVERY_NODE
        or (name in _PRIVATE_OF_EVERY_NODE and folder == own_name(node, "~"))
        or bool(_matched_ports(node, ports, remapping))
    )


def _remapping_hint(node: Node, source: str, names: tuple[str, ...]) -> str | None:
    port = node.port(source)
    if port is not None:
        return f"the {port.kind.channel} of port '{source}' is named '{port.ros_name}'"
    return suggestion(source, names)


def check_remapping_collision(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that each remapping renames."""
    for node in context.system.nodes:
        if not node.remappings:
            continue
        joined: dict[tuple[PortKind, str], list[Port]] = defaultdict(list)
        for port in node.ports:
            joined[port.kind, port.full_name].append(port)
        reported: set[tuple[PortKind, str]] = set()
        ports = _ports_by_name(node)
        for remapping in node.remappings:
            matched = _matched_ports(node, ports, remapping)
            yield from _collision(node, remapping, matched, joined, reported)


def _collision(
    node: Node,
    remapping: Remapping,
    matched: Sequence[Port],
    joined: dict[tuple[PortKind, str], list[Port]],
    reported: set[tuple[PortKind, str]],
) -> Iterator[Diagnostic]:
    """Report each name once, for the first remapping that causes it."""
    if is_unresolved(remapping.target.value):
        return
    target = own_name(node, remapping.target.value)
    for port in matched:
        others = [other for other in joined[port.kind, target] if other is not port]
        if port.full_name == target and others and (port.kind, target) not in reported:
            reported.add((port.kind, target))
            yield Diagnostic(
                REMAPPING_COLLISION,
                f"remapping '{remapping.source}' to '{remapping.target}' gives {port.kind}s "
                f"'{port.name}' and '{others[0].name}' of one node the name '{target}'",
                remapping.target.span,
                (Label(others[0].name.span, "already has this name"),),
            )


def check_unused_remapping(context: Context) -> Iterator[Diagnostic]:
    """Check the final names of remapped ports."""
    for node in context.system.nodes:
        ports_by_name = _ports_by_name(node)
        for remapping in node.remappings:
            matched = _matched_ports(node, ports_by_name, remapping)
            yield from _overridden_remapping(node, remapping, matched)
        # In a class or a program, the name of a port is what the connection renames.
        if not node.remappings and node.implementation not in _NAMES_IN_CODE:
            for port in node.ports:
                if port.ros_name is not port.name:
                    yield from _overridden_name(node, port)


def _overridden_name(node: Node, port: Port) -> Iterator[Diagnostic]:
    """Report the name of a port of an inline node that its connection, too, gives a name."""
    name = port.ros_name
    is_inline = name.span.file == node.name.span.file and name.span != port.name.span
    if not is_inline or is_unresolved(name.value) or is_unresolved(port.full_name):
        return
    if own_name(node, name.value) != port.full_name:
        word = port.kind.channel.value
        yield Diagnostic(
            UNUSED_REMAPPING,
            f"{word} '{shown(name.value)}' has no effect: the connection gives "
            f"'{node.name}.{port.name}' the name '{port.full_name}'",
            name.span,
            hint=f"remove '{word}' here, or the port from the connection",
            relies_on=wiring(node, port),
        )


def _overridden_remapping(
    node: Node, remapping: Remapping, ports: Sequence[Port]
) -> Iterator[Diagnostic]:
    target = remapping.target.value
    if not ports or is_unresolved(target):
        return
    expected = own_name(node, target)
    actual = sorted({port.full_name for port in ports} - {expected})
    if any(port.full_name == expected for port in ports) or not actual:
        return
    yield Diagnostic(
        UNUSED_REMAPPING,
        f"remapping '{remapping.source}' to '{target}' has no effect: "
        f"the final name is '{actual[0]}'",
        remapping.source.span,
        hint="remove the remapping, or remove the port from its connection",
        relies_on=tuple(subject for port in ports for subject in wiring(node, port)),
    )
