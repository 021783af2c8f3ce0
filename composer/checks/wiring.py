"""Which ports have nobody at the other end, where that can be known."""

from __future__ import annotations

from collections.abc import Iterator

from composer.checks.context import Context
from composer.model import Connection, PortKind, PortOfNode

#: Topics that ROS itself or a tool writes or reads; their other end is never in a system.
_OUTSIDE = frozenset(
    {"/clock", "/diagnostics", "/parameter_events", "/robot_description", "/rosout"}
    | {"/tf", "/tf_static"}
)


def lonely_ends(context: Context, kind: PortKind) -> Iterator[PortOfNode]:
    """Yield the ports of ``kind`` whose topic, service or action has nothing on the other side.

    Left out are ports with ``external: true`` or ``required: false``, and all for which a mistake
    elsewhere may be the cause: an unknown node type, a connection that names what is not there, a
    remapping that matches nothing.
    """
    if context.system.node_type or not all(node.complete for node in context.system.nodes):
        return
    doubtful = context.once(_doubtful)
    for channel in context.channels:
        others = channel.sinks if kind in _SOURCES else channel.sources
        if others or channel.name in _OUTSIDE:
            continue
        for end in channel.ends:
            port = end.port
            if port.kind is not kind or port.external or port.required is False:
                continue
            if not {(end.node.name.value, port.name.value), ("", port.name.value)} & doubtful:
                yield end


_SOURCES = (PortKind.PUBLISHER, PortKind.SERVICE, PortKind.ACTION_SERVER)


def _doubtful(context: Context) -> set[tuple[str, str]]:
    """Return node and port of what a faulty connection may have been meant for.

    An empty node stands for every node.
    """
    system = context.system
    doubtful: set[tuple[str, str]] = set()
    for connection in system.connections:
        broken = [text for text in _endpoints(connection) if not _fits(context, connection, text)]
        if not broken:
            continue
        doubtful.update(_endpoints(connection))
        for node_name, port_name in broken:
            node = system.node(node_name)
            if node is None:
                doubtful.add(("", port_name))
            else:
                doubtful.update((node_name, port.name.value) for port in node.ports)
    return doubtful


def _endpoints(connection: Connection) -> Iterator[tuple[str, str]]:
    for endpoint in (*connection.sources, *connection.sinks):
        yield endpoint.node, endpoint.port


def _fits(context: Context, connection: Connection, end: tuple[str, str]) -> bool:
    node = context.system.node(end[0])
    port = node.port(end[1]) if node is not None else None
    return port is not None and port.kind.channel is connection.kind
