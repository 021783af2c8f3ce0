"""Ports without a counterpart in the system, as far as that can be known."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import field
from typing import TypeAlias

from composer.analysis.context import Context, is_unresolved
from composer.analysis.earlier_errors import earlier_errors
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, error, info, warning
from composer.fast_dataclass import dataclass
from composer.model import ChannelKind, Connection, Node, PortKind, PortOfNode
from composer.rules.remappings import matched_ports, own_name
from composer.source import Span
from composer.spelling import vocabulary

CLIENT_WITHOUT_SERVER = warning("RC322", "client-without-server")
SUBSCRIPTION_WITHOUT_PUBLISHER = warning("RC323", "subscription-without-publisher")
PUBLISHER_WITHOUT_SUBSCRIPTION = info("RC324", "publisher-without-subscription")
REQUIRED_PORT_UNCONNECTED = error("RC325", "required-port-unconnected")

#: Topics of ROS itself and of tools; their counterpart is never in the system.
_EXTERNAL_TOPICS = frozenset(
    {"/clock", "/diagnostics", "/parameter_events", "/robot_description", "/rosout"}
    | {"/tf", "/tf_static"}
)
_SOURCES = {
    ChannelKind.TOPIC: PortKind.PUBLISHER,
    ChannelKind.SERVICE: PortKind.SERVICE,
    ChannelKind.ACTION: PortKind.ACTION_SERVER,
}
_SINKS = {
    ChannelKind.TOPIC: PortKind.SUBSCRIPTION,
    ChannelKind.SERVICE: PortKind.CLIENT,
    ChannelKind.ACTION: PortKind.ACTION_CLIENT,
}
#: The kind of port that each kind of port connects to.
COUNTERPARTS = {_SOURCES[kind]: _SINKS[kind] for kind in ChannelKind} | {
    _SINKS[kind]: _SOURCES[kind] for kind in ChannelKind
}

#: Maximum number of similar names to consider, because the port's own name is among them.
_MAXIMUM_CANDIDATES = 5
#: For a kind of port and an interface: the names of such ports, each with their nodes.
_ChannelNames: TypeAlias = dict[tuple[PortKind, str], dict[str, set[str]]]


def unconnected_ports(context: Context, kind: PortKind) -> Iterator[PortOfNode]:
    """Yield the ports of ``kind`` whose topic, service or action has no counterpart.

    Ports with ``external: true`` or ``required: false`` are left out, and so are sources named by a
    connection (``from`` without ``to`` is deliberate). So are ports that may lack a counterpart due
    to another error: an earlier error, an unknown node type, a connection to an unknown port, or a
    remapping that matches no port.
    """
    if not _is_fully_known(context):
        return
    uncertain = context.once(_uncertain)
    is_source = kind in _SOURCES.values()
    for channel in context.channels:
        others = channel.sinks if is_source else channel.sources
        if others or channel.name in _EXTERNAL_TOPICS or channel.name in uncertain.names:
            continue
        for endpoint in channel.ends:
            port = endpoint.port
            if port.kind is not kind or port.external or port.required is False:
                continue
            if is_source and _key(endpoint) in uncertain.connected:
                continue
            if not uncertain.includes(endpoint):
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


def external_hint(endpoint: PortOfNode) -> str:
    """Return the hint for a port whose counterpart is an external node."""
    port = endpoint.port
    key = "external: true"
    if port.name.span.file != endpoint.node.span.file:
        key = f"{port.kind.section}: {{{port.name}: {{external: true}}}}"
    return f"set '{key}' if an external node does"


@dataclass(slots=True)
class _Uncertain:
    """Ports and names that may be unconnected due to an error that is reported elsewhere."""

    ports: set[tuple[str, str]] = field(default_factory=set)
    port_names: set[str] = field(default_factory=set)  # of unknown nodes
    names: set[str] = field(default_factory=set)
    connected: set[tuple[str, str]] = field(default_factory=set)  # named by any connection

    def includes(self, endpoint: PortOfNode) -> bool:
        return _key(endpoint) in self.ports or endpoint.port.name.value in self.port_names

    def add_ports_of(self, node: Node) -> None:
        self.ports.update((node.name.value, port.name.value) for port in node.ports)


def _is_fully_known(context: Context) -> bool:
    system = context.system
    return (
        not context.once(earlier_errors).elsewhere
        and not system.node_type
        and all(node.complete for node in system.nodes)
        and not any(is_unresolved(port.full_name) for node in system.nodes for port in node.ports)
    )


def _uncertain(context: Context) -> _Uncertain:
    uncertain = _Uncertain()
    for connection in context.system.connections:
        _add_connection(context, connection, uncertain)
    affected = context.once(earlier_errors).nodes
    for node in context.system.nodes:
        if node.name.value in affected:
            uncertain.add_ports_of(node)
            uncertain.names.update(port.full_name for port in node.ports)
        for remapping in () if node.gets_undeclared else node.remappings:
            if not any(matched_ports(node, remapping)):
                uncertain.add_ports_of(node)
                uncertain.names.add(own_name(node, remapping.target.value))
    return uncertain


def _add_connection(context: Context, connection: Connection, uncertain: _Uncertain) -> None:
    system = context.system
    references = [(reference, _SOURCES[connection.kind]) for reference in connection.sources]
    references += [(reference, _SINKS[connection.kind]) for reference in connection.sinks]
    invalid = []
    renamed = False
    for reference, kind in references:
        port = system.port(reference)
        if port is None or port.kind is not kind:
            invalid.append(reference)
        elif port.full_name.lstrip("/") != connection.name.value.lstrip("/"):
            renamed = renamed or not port.full_name.endswith(f"/{connection.name}")
        uncertain.connected.add((reference.node, reference.port))
    if invalid or renamed:
        uncertain.ports.update((reference.node, reference.port) for reference, _ in references)
    for reference in invalid:
        node = system.node(reference.node)
        if node is None:
            uncertain.port_names.add(reference.port)
        else:
            uncertain.add_ports_of(node)


def _key(endpoint: PortOfNode) -> tuple[str, str]:
    return endpoint.node.name.value, endpoint.port.name.value


def nearest_channel(context: Context, endpoint: PortOfNode) -> str | None:
    """Return a hint with the most similar name of a possible counterpart, or None."""
    name = _nearest_name(context, endpoint)
    return f"did you mean '{name}'?" if name is not None else None


def _nearest_name(context: Context, endpoint: PortOfNode) -> str | None:
    port = endpoint.port
    counterpart = (COUNTERPARTS[port.kind], port.interface.value)
    nodes = context.once(_channel_names).get(counterpart, {})
    for name in vocabulary(tuple(nodes)).close(port.full_name, _MAXIMUM_CANDIDATES):
        if name != port.full_name and nodes[name] != {endpoint.node.name.value}:
            return name
    return None


def is_meant_by_another(context: Context, publisher: PortOfNode) -> bool:
    """Return whether a subscription without a publisher is probably meant to have this one.

    That is, its name is similar, and is written less often: it is the misspelled one of the two.
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


def check_client_without_server(context: Context) -> Iterator[Diagnostic]:
    """Check for services and actions that have only clients."""
    for kind in (PortKind.CLIENT, PortKind.ACTION_CLIENT):
        for endpoint in unconnected_ports(context, kind):
            if endpoint.port.required is None:
                place, labels = name_location(endpoint)
                yield Diagnostic(
                    CLIENT_WITHOUT_SERVER,
                    f"no node in this system provides '{endpoint.port.full_name}', "
                    f"which '{port_name(endpoint)}' calls",
                    place,
                    labels,
                    nearest_channel(context, endpoint) or external_hint(endpoint),
                )


def check_subscription_without_publisher(context: Context) -> Iterator[Diagnostic]:
    """Check for topics that have only subscriptions."""
    for endpoint in unconnected_ports(context, PortKind.SUBSCRIPTION):
        if endpoint.port.required is None:
            place, labels = name_location(endpoint)
            yield Diagnostic(
                SUBSCRIPTION_WITHOUT_PUBLISHER,
                f"no node in this system publishes '{endpoint.port.full_name}', "
                f"which '{port_name(endpoint)}' subscribes to",
                place,
                labels,
                nearest_channel(context, endpoint) or external_hint(endpoint),
            )


def check_publisher_without_subscription(context: Context) -> Iterator[Diagnostic]:
    """Check for topics that have only publishers."""
    for endpoint in unconnected_ports(context, PortKind.PUBLISHER):
        if endpoint.port.required is None and not is_meant_by_another(context, endpoint):
            place, labels = name_location(endpoint)
            yield Diagnostic(
                PUBLISHER_WITHOUT_SUBSCRIPTION,
                f"no node in this system subscribes to '{endpoint.port.full_name}', "
                f"which '{port_name(endpoint)}' publishes",
                place,
                labels,
                external_hint(endpoint),
            )


def check_required_port_unconnected(context: Context) -> Iterator[Diagnostic]:
    """Check the ports that are declared as required."""
    for kind in PortKind:
        for endpoint in unconnected_ports(context, kind):
            if endpoint.port.required:
                yield Diagnostic(
                    REQUIRED_PORT_UNCONNECTED,
                    f"port '{port_name(endpoint)}' must be connected, "
                    f"but '{endpoint.port.full_name}' has no {COUNTERPARTS[endpoint.port.kind]}",
                    endpoint.node.name.span,
                    (Label(endpoint.port.name.span, "declared as required"),),
                    nearest_channel(context, endpoint),
                )
