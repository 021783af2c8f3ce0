"""Which ports have nobody at the other end, where that can be known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from composer.analysis.context import Context, is_opaque
from composer.analysis.doubt import doubt
from composer.analysis.remapped import matched_ports, own_name
from composer.diagnostics import Label
from composer.model import ChannelKind, Connection, Endpoint, Node, PortKind, PortOfNode
from composer.source import Span

#: Topics that ROS itself or a tool writes or reads; their other end is never in a system.
_OUTSIDE = frozenset(
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


def lonely_ends(context: Context, kind: PortKind) -> Iterator[PortOfNode]:
    """Yield the ports of ``kind`` whose topic, service or action has nothing on the other side.

    Left out are ports with ``external: true`` or ``required: false``, sources that a connection
    names (who writes ``from`` without ``to`` means it), and all for which a mistake elsewhere may
    be the cause: a part of the file that was refused, an unknown node type, a connection that
    names what is not there, a remapping that matches nothing.
    """
    if not _is_whole(context):
        return
    doubts = context.once(_doubts)
    is_source = kind in _SOURCES.values()
    for channel in context.channels:
        others = channel.sinks if is_source else channel.sources
        if others or channel.name in _OUTSIDE or channel.name in doubts.names:
            continue
        for end in channel.ends:
            port = end.port
            if port.kind is not kind or port.external or port.required is False:
                continue
            if not doubts.concern(end) and not (is_source and _key(end) in doubts.connected):
                yield end


def place_of(end: PortOfNode) -> tuple[Span, tuple[Label, ...]]:
    """Return where a finding about the wiring of a port belongs, and what else to show.

    That is the port where it is declared; the node in the system where the declaration is that of
    a node type in another file, which may be wired differently elsewhere.
    """
    declared = end.port.name.span
    if declared.file == end.node.span.file:
        return declared, ()
    return end.node.name.span, (Label(declared, f"{end.port.kind} '{end.port.name}'"),)


def external_hint(end: PortOfNode) -> str:
    """Return the hint for a port whose counterpart is an external node."""
    port = end.port
    key = "external: true"
    if port.name.span.file != end.node.span.file:
        key = f"{port.kind.section}: {{{port.name}: {{external: true}}}}"
    return f"set '{key}' if an external node does"


@dataclass(slots=True)
class _Doubts:
    """What may be wired wrongly because of a mistake that is reported elsewhere."""

    ports: set[tuple[str, str]] = field(default_factory=set)
    port_names: set[str] = field(default_factory=set)  # of a node nobody knows
    names: set[str] = field(default_factory=set)
    connected: set[tuple[str, str]] = field(default_factory=set)  # in no doubt at all

    def concern(self, end: PortOfNode) -> bool:
        return _key(end) in self.ports or end.port.name.value in self.port_names

    def doubt_node(self, node: Node) -> None:
        self.ports.update((node.name.value, port.name.value) for port in node.ports)


def _is_whole(context: Context) -> bool:
    system = context.system
    return (
        not context.once(doubt).elsewhere
        and not system.node_type
        and all(node.complete for node in system.nodes)
        and not any(is_opaque(port.full_name) for node in system.nodes for port in node.ports)
    )


def _doubts(context: Context) -> _Doubts:
    doubts = _Doubts()
    for connection in context.system.connections:
        _doubt_connection(context, connection, doubts)
    suspects = context.once(doubt).nodes
    for node in context.system.nodes:
        if node.name.value in suspects:
            doubts.doubt_node(node)
            doubts.names.update(port.full_name for port in node.ports)
        for remapping in node.remappings:
            if not any(matched_ports(node, remapping)):
                doubts.doubt_node(node)
                doubts.names.add(own_name(node, remapping.target.value))
    return doubts


def _doubt_connection(context: Context, connection: Connection, doubts: _Doubts) -> None:
    system = context.system
    ends = [(end, _SOURCES[connection.kind]) for end in connection.sources]
    ends += [(end, _SINKS[connection.kind]) for end in connection.sinks]
    broken = []
    moved = False
    for end, kind in ends:
        port = system.port(end)
        if port is None or port.kind is not kind:
            broken.append(end)
        elif port.full_name.lstrip("/") != connection.name.value.lstrip("/"):
            moved = moved or not port.full_name.endswith(f"/{connection.name}")
        doubts.connected.add((end.node, end.port))
    if broken or moved:
        doubts.ports.update((end.node, end.port) for end, _ in ends)
    for end in broken:
        _doubt_end(system.node(end.node), end, doubts)


def _doubt_end(node: Node | None, end: Endpoint, doubts: _Doubts) -> None:
    if node is None:
        doubts.port_names.add(end.port)
    else:
        doubts.doubt_node(node)


def _key(end: PortOfNode) -> tuple[str, str]:
    return end.node.name.value, end.port.name.value
