"""Ports without a counterpart in the system, as far as that can be known."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import replace
from typing import TypeAlias

from composer.base.diagnostics import (
    Diagnostic,
    Label,
    Severity,
    error,
    info,
    nearest,
    suggestion,
    warning,
)
from composer.base.source import Span
from composer.base.spelling import vocabulary
from composer.language.rules import MAX_ERRORS
from composer.model import ChannelKind, PortKind, PortOfNode, channels
from composer.model.names import join, matches_wildcard
from composer.rules.analysis.context import Context, is_unresolved, limited
from composer.rules.analysis.formatting import port_name
from composer.rules.analysis.subjects import earlier_errors, wiring

CLIENT_WITHOUT_SERVER = warning("RC322", "client-without-server")
SUBSCRIPTION_WITHOUT_PUBLISHER = warning("RC323", "subscription-without-publisher")
PUBLISHER_WITHOUT_SUBSCRIPTION = info("RC324", "publisher-without-subscription")
REQUIRED_PORT_UNCONNECTED = error("RC325", "required-port-unconnected")

#: Topics of ROS itself and of tools; their counterpart is never in the system.
_EXTERNAL_TOPICS = frozenset(
    {"/clock", "/diagnostics", "/parameter_events", "/robot_description", "/rosout"}
    | {"/tf", "/tf_static"}
)
_OUTSIDE = "record what other programs publish by 'compose record'"
#: Maximum number of similar names to consider, because the port's own name is among them.
_MAXIMUM_CANDIDATES = 5
#: For a kind of port and an interface: the names of such ports, each with their nodes.
_ChannelNames: TypeAlias = dict[tuple[PortKind, str], dict[str, set[str]]]
#: Of a port without a counterpart: the rule, what no other node does, and what its own node does.
_UNCONNECTED = {
    PortKind.CLIENT: (CLIENT_WITHOUT_SERVER, "provides", "calls"),
    PortKind.ACTION_CLIENT: (CLIENT_WITHOUT_SERVER, "provides", "calls"),
    PortKind.SUBSCRIPTION: (SUBSCRIPTION_WITHOUT_PUBLISHER, "publishes", "subscribes to"),
    PortKind.PUBLISHER: (PUBLISHER_WITHOUT_SUBSCRIPTION, "subscribes to", "publishes"),
}
#: Names and patterns that ``recording`` lists and that are looked for; a file lists a few.
_MAX_PATTERNS = 50


def unconnected_ports(context: Context, kind: PortKind) -> Iterator[PortOfNode]:
    """Yield the ports of ``kind`` whose topic, service or action has no counterpart.

    Ports with ``external: true`` or ``required: false`` are left out, and so are sources named by a
    connection (``from`` without ``to`` is deliberate). So are ports that may lack a counterpart due
    to an earlier error or an unknown node type.
    """
    if not context.once(_is_fully_known):
        return
    connected, affected = context.once(_connected), context.once(_names_of_affected)
    for channel in context.channels:
        others = channel.sinks if kind.is_source else channel.sources
        if others or channel.name in _EXTERNAL_TOPICS or channel.name in affected:
            continue
        for endpoint in channel.ends:
            port = endpoint.port
            if port.kind is not kind or port.external or port.required is False:
                continue
            if not (kind.is_source and endpoint.key in connected):
                yield endpoint


def diagnostic_location(endpoint: PortOfNode) -> tuple[Span, tuple[Label, ...]]:
    """Return the span for a diagnostic about the connections of a port, and further labels.

    This is the declaration of the port. If a node type in another file declares it, this is the
    node in the system, because other systems may connect the port.
    """
    declared = endpoint.port.name.span
    if declared.file == endpoint.node.span.file:
        return declared, ()
    return endpoint.node.name.span, (_port_label(endpoint),)


def name_location(endpoint: PortOfNode) -> tuple[Span, tuple[Label, ...]]:
    """Return the span for a diagnostic about the name of a port, and further labels.

    This is the name of the connection that sets it, else as :func:`diagnostic_location`.
    """
    connected_at = endpoint.port.connected_at
    if connected_at is None:
        return diagnostic_location(endpoint)
    return connected_at, (_port_label(endpoint),)


def _port_label(endpoint: PortOfNode) -> Label:
    return Label(endpoint.port.name.span, f"{endpoint.port.kind} '{endpoint.port.name}'")


def external_hint(endpoint: PortOfNode, undescribed: str | None) -> str:
    """Return the hint for a port whose other end may be outside the system, or not declared."""
    port = endpoint.port
    key = "external: true"
    if port.name.span.file != endpoint.node.span.file:
        key = f"{port.kind.section}: {{{port.name}: {{external: true}}}}"
    outside = f"set '{key}' if a node outside the system does"
    return outside if undescribed is None else f"{_declare_in(undescribed)}, or {outside}"


def _declare_in(undescribed: str) -> str:
    return f"declare it in '{undescribed}' if that node does"


def _is_fully_known(context: Context) -> bool:
    system = context.system
    return (
        not context.once(earlier_errors).elsewhere
        and not system.node_type
        and all(node.complete for node in system.nodes)
        and not any(is_unresolved(port.full_name) for node in system.nodes for port in node.ports)
    )


def _connected(context: Context) -> frozenset[tuple[str, str]]:
    """Return the ports that connections name, as node and port."""
    system = context.system
    return frozenset((end.node, end.port) for item in system.connections for end in item.ends)


def _names_of_affected(context: Context) -> frozenset[str]:
    """Return the names of the ports of nodes with earlier errors, which may have other ports."""
    system, affected = context.system, context.once(earlier_errors).nodes
    nodes = (node for node in system.nodes if node.name.value in affected)
    names = {port.full_name for node in nodes for port in node.ports}
    for connection in system.connections if affected else ():
        if any(end.node in affected for end in connection.ends):
            names.add(join(system.namespace, connection.name.value))
    return frozenset(names)


def nearest_channel(context: Context, endpoint: PortOfNode) -> str | None:
    """Return a hint with the most similar name of a possible counterpart, or None."""
    name = _nearest_name(context, endpoint)
    return f"did you mean '{name}'?" if name is not None else None


def _nearest_name(context: Context, endpoint: PortOfNode) -> str | None:
    """Return the most similar name of a possible counterpart, or None.

    Names are searched for the first ports only, since each search takes about a millisecond.
    """
    searched = context.once(_nearest_names)
    key = endpoint.key
    if key not in searched and len(searched) < MAX_ERRORS:
        searched[key] = next(_similar_names(context, endpoint), None)
    return searched.get(key)


def _nearest_names(_: Context) -> dict[tuple[str, str], str | None]:
    return {}


def _similar_names(context: Context, endpoint: PortOfNode) -> Iterator[str]:
    port = endpoint.port
    counterpart = (port.kind.counterpart, port.interface.value)
    nodes = context.once(_channel_names).get(counterpart, {})
    for name in vocabulary(tuple(nodes)).close(port.full_name, _MAXIMUM_CANDIDATES):
        if name != port.full_name and nodes[name] != {endpoint.node.name.value}:
            yield name


def is_meant_by_another(context: Context, publisher: PortOfNode) -> bool:
    """Return whether a subscription without a publisher probably means this publisher.

    Their names are similar, and the name of the subscription is written less often, so that is the
    misspelled one.
    """
    key = (publisher.port.interface.value, publisher.port.full_name)
    meant = context.once(_meant_publishers).get(key)
    if meant is None:
        return False
    return _occurrences(context, meant) < _occurrences(context, publisher)


def _meant_publishers(context: Context) -> dict[tuple[str, str], PortOfNode]:
    """Return the subscriptions without a publisher, by interface and the name they may mean."""
    found: dict[tuple[str, str], PortOfNode] = {}
    for endpoint in unconnected_ports(context, PortKind.SUBSCRIPTION):
        name = _nearest_name(context, endpoint) if endpoint.port.required is None else None
        if name is not None:
            found.setdefault((endpoint.port.interface.value, name), endpoint)
    return found


def _occurrences(context: Context, endpoint: PortOfNode) -> int:
    """Return how often the last part of the name of a port is written in the file."""
    words = context.once(_words)[endpoint.port.name.span.file.path]
    return words[endpoint.port.full_name.rpartition("/")[2]]


def _words(context: Context) -> dict[str, Counter[str]]:
    """Return how often each word is written, in the files that declare ports."""
    files = {
        port.name.span.file.path: port.name.span.file
        for node in context.system.nodes
        for port in node.ports
    }
    return {path: Counter(re.findall(r"\w+", file.text)) for path, file in files.items()}


def _channel_names(context: Context) -> _ChannelNames:
    found: _ChannelNames = {}
    for channel in context.channels:
        for endpoint in channel.ends:
            names = found.setdefault((endpoint.port.kind, endpoint.port.interface.value), {})
            names.setdefault(channel.name, set()).add(endpoint.node.name.value)
    return found


@limited
def check_unconnected_port(context: Context) -> Iterator[Diagnostic]:
    """Check for topics, services and actions that have ports of one side only."""
    for kind, (rule, not_done, done) in _UNCONNECTED.items():
        for endpoint in unconnected_ports(context, kind):
            port, hint = endpoint.port, None
            if port.required is not None:
                continue
            if kind is not PortKind.PUBLISHER:
                hint = nearest_channel(context, endpoint)
            elif is_meant_by_another(context, endpoint):
                continue
            place, labels = name_location(endpoint)
            undescribed = context.once(undescribed_node) if hint is None else None
            does_not = not_done if undescribed is None else f"declares that it {not_done}"
            yield Diagnostic(
                rule if undescribed is None else replace(rule, severity=Severity.INFO),
                f"no node in this system {does_not} '{port.full_name}', "
                f"which '{port_name(endpoint)}' {done}",
                place,
                labels,
                hint or external_hint(endpoint, undescribed),
                relies_on=wiring(endpoint.node, port),
            )


def no_node(
    context: Context, does: str, name: str, names: Collection[str]
) -> tuple[str, str | None]:
    """Return the message that no node ``does`` something with ``name``, and a hint.

    ``names`` are those with which a node does it.
    """
    node = context.once(undescribed_node)
    if node is None or nearest(name, names) is not None:
        return f"no node {does} '{name}'", suggestion(name, names)
    return f"no node declares that it {does} '{name}'", _declare_in(node)


def undescribed_node(context: Context) -> str | None:
    """Return a node that may have any port, since YAML declares none of its ports, or None.

    Containers of components are left out: they have no ports to declare.
    """
    containers = {node.container.value for node in context.system.nodes if node.container}
    names = (
        node.name.value
        for node in context.system.nodes
        if node.gets_undeclared and not node.ports and node.name.value not in containers
    )
    return next(names, None)


def check_recorded_name(context: Context) -> Iterator[Diagnostic]:
    """Check that nodes in the processes of the system send what ``recording`` names."""
    system = context.system
    recording = system.recording
    nodes = [node for node in system.nodes if node.implementation.in_process]
    if recording is None or not _is_fully_known(context):
        return
    if any(node.hosted_class is not None for node in nodes):
        return  # a class may create ports that YAML does not declare
    used = channels(nodes, with_transforms=True)
    names = {kind: [item.name for item in used if item.kind is kind] for kind in ChannelKind}
    topics = [item.name for item in used if item.kind is ChannelKind.TOPIC and item.sources]
    topics += ["/rosout", "/parameter_events"]
    topics += [f"{node.full_name}/transition_event" for node in nodes]
    for kind, rule, verb, known in (
        ("topics", SUBSCRIPTION_WITHOUT_PUBLISHER, "publishes", topics),
        ("services", CLIENT_WITHOUT_SERVER, "provides or calls", names[ChannelKind.SERVICE]),
        ("actions", CLIENT_WITHOUT_SERVER, "provides", names[ChannelKind.ACTION]),
    ):
        for pattern in recording.patterns[kind][:_MAX_PATTERNS]:
            text = pattern.value
            if is_unresolved(text) or any(matches_wildcard(text, name) for name in known):
                continue
            is_outside = any(matches_wildcard(text, item.name) for item in context.channels)
            yield Diagnostic(
                rule,
                f"no node in a process of this system {verb} '{text}', which 'recording' lists",
                pattern.span,
                hint=_OUTSIDE if is_outside else suggestion(text, known),
            )


def check_required_port_unconnected(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that are declared as required."""
    ports = (port for node in context.system.nodes for port in node.ports)
    rule = REQUIRED_PORT_UNCONNECTED
    if context.once(undescribed_node) is not None:
        rule = replace(rule, severity=Severity.WARNING)
    for kind in sorted({port.kind for port in ports if port.required}):
        for endpoint in unconnected_ports(context, kind):
            if endpoint.port.required:
                yield Diagnostic(
                    rule,
                    f"port '{port_name(endpoint)}' must be connected, "
                    f"but '{endpoint.port.full_name}' has no {endpoint.port.kind.counterpart}",
                    endpoint.node.name.span,
                    (Label(endpoint.port.name.span, "declared as required"),),
                    nearest_channel(context, endpoint),
                    relies_on=wiring(endpoint.node, endpoint.port),
                )
