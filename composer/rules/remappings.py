"""Remappings: names that no port has, collisions, and connections that take precedence."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
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
from composer.base.spelling import is_typo
from composer.model import ImplementationKind, Node, Port, PortKind, Remapping
from composer.model.names import expand_name, remapped_name, topic_name_problem
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.subjects import wiring

UNKNOWN_REMAPPING = error("RC208", "unknown-remapping")
REMAPPING_COLLISION = warning("RC226", "remapping-collision")
UNUSED_REMAPPING = warning("RC241", "unused-remapping")


def own_name(node: Node, name: str) -> str:
    """Return the full name of ``name`` in ``node`` before remapping."""
    return expand_name(name, node.ros_name.value, node.namespace.value)


def matched_ports(node: Node, remapping: Remapping) -> Iterator[Port]:
    """Yield the ports whose declared name the remapping replaces."""
    source = own_name(node, remapped_name(remapping.source.value))
    for port in node.all_ports:
        if own_name(node, port.ros_name.value) == source:
            yield port


_RULE_IF_PASSED_ON = replace(UNKNOWN_REMAPPING, severity=Severity.INFO)
#: Names that every ROS node has without declaring them, before expansion.
_EVERY_NODE = (
    "/clock",
    "/diagnostics",
    "/parameter_events",
    "/rosout",
    "~/describe_parameters",
    "~/get_logger_levels",
    "~/get_parameter_types",
    "~/get_parameters",
    "~/get_type_description",
    "~/list_parameters",
    "~/set_logger_levels",
    "~/set_parameters",
    "~/set_parameters_atomically",
    "~/change_state",
    "~/get_available_states",
    "~/get_available_transitions",
    "~/get_state",
    "~/get_transition_graph",
    "~/transition_event",
)


def check_unknown_remapping(context: Context) -> Iterator[Diagnostic]:
    """Check the name that each remapping replaces."""
    for node in context.system.nodes:
        if not node.complete or any(is_unresolved(port.ros_name.value) for port in node.ports):
            continue
        for remapping in node.remappings:
            source = remapping.source
            if _is_known(node, remapping) or (
                node.gets_undeclared
                and not any(is_typo(source.value, port.ros_name.value) for port in node.ports)
            ):
                continue
            yield Diagnostic(
                _RULE_IF_PASSED_ON if node.gets_undeclared else UNKNOWN_REMAPPING,
                f"node '{node.name}' has no port named '{source}' to remap",
                source.span,
                hint=_remapping_hint(node, source.value),
                subjects=() if node.gets_undeclared else tuple(_names_meant(node, remapping)),
            )


def _names_meant(node: Node, remapping: Remapping) -> Iterator[Subject]:
    """Yield what is not known if a remapping names no port: any port of the node may be meant."""
    yield ("name", own_name(node, remapping.target.value))
    for port in node.ports:
        yield from wiring(node, port)


def _is_known(node: Node, remapping: Remapping) -> bool:
    source = remapping.source.value
    if is_unresolved(source) or topic_name_problem(source) is not None:
        return True  # cannot be checked, or is reported by another rule
    return any(matched_ports(node, remapping)) or own_name(node, source) in {
        own_name(node, name) for name in _EVERY_NODE
    }


def _remapping_hint(node: Node, source: str) -> str | None:
    port = node.port(source)
    if port is not None:
        return f"the {port.kind.channel} of port '{source}' is named '{port.ros_name}'"
    return suggestion(source, [port.ros_name.value for port in node.ports])


def check_remapping_collision(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that each remapping renames."""
    for node in context.system.nodes:
        if not node.remappings:
            continue
        joined: dict[tuple[PortKind, str], list[Port]] = defaultdict(list)
        for port in node.ports:
            joined[port.kind, port.full_name].append(port)
        reported: set[tuple[PortKind, str]] = set()
        for remapping in node.remappings:
            yield from _collision(node, remapping, joined, reported)


def _collision(
    node: Node,
    remapping: Remapping,
    joined: dict[tuple[PortKind, str], list[Port]],
    reported: set[tuple[PortKind, str]],
) -> Iterator[Diagnostic]:
    """Report each name once, for the first remapping that causes it."""
    if is_unresolved(remapping.target.value):
        return
    target = own_name(node, remapping.target.value)
    for port in matched_ports(node, remapping):
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


_NAMES_IN_CODE = (
    ImplementationKind.CLASS,
    ImplementationKind.EXECUTABLE,
    ImplementationKind.COMPONENT,
)


def check_unused_remapping(context: Context) -> Iterator[Diagnostic]:
    """Check the final names of remapped ports."""
    for node in context.system.nodes:
        for remapping in node.remappings:
            yield from _overridden_remapping(node, remapping)
        # In a class or a program, the name of a port is what the connection renames.
        if not node.remappings and node.implementation not in _NAMES_IN_CODE:
            for port in node.ports:
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


def _overridden_remapping(node: Node, remapping: Remapping) -> Iterator[Diagnostic]:
    target = remapping.target.value
    ports = list(matched_ports(node, remapping))
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
