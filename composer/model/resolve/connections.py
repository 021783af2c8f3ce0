"""Connections with the names and QoS profiles that they give to ports, and chains."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.tree import (
    Entry,
    Mapping,
    Sequence,
    Tree,
    choice,
    entries,
    is_opaque,
    key,
    mapping,
    number,
    text,
    texts,
)
from composer.model import (
    Chain,
    ChannelKind,
    Connection,
    Delivery,
    Endpoint,
    Isolation,
    Port,
    PortKind,
    Qos,
)
from composer.model.names import join
from composer.model.resolve.qos import QosTable, implicit_qos

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class PortConnection:
    """The full name and, if set, the QoS profile and delivery that a connection gives to a port."""

    kind: ChannelKind
    full_name: str
    span: Span  # of the name
    qos: Qos | None
    delivery: Delivery | None = None
    isolation: Isolation | None = None
    from_source: bool | None = None  # of a topic: whether the port is listed in 'from'


PortConnections = dict[tuple[str, str], list[PortConnection]]


def read_connections(
    tree: Tree | None, namespace: str, qos: QosTable
) -> tuple[tuple[Connection, ...], PortConnections]:
    """Return the declared ``connections``, and what they give to each port."""
    declared = []
    port_connections: PortConnections = {}
    for item in tree.items if isinstance(tree, Sequence) else ():
        connection = _connection(item)
        if connection is None:
            continue
        declared.append(connection)
        given = (
            connection.kind,
            full_name(connection.name.value, namespace),
            connection.name.span,
            _profile(item, connection.kind, qos),
            connection.delivery.value if connection.delivery else None,
            connection.isolation.value if connection.isolation else None,
        )
        is_topic = connection.kind is ChannelKind.TOPIC
        for is_source, ends in ((True, connection.sources), (False, connection.sinks)):
            port_connection = PortConnection(*given, is_source if is_topic else None)
            for end in ends:
                port_connections.setdefault((end.node, end.port), []).append(port_connection)
    return tuple(declared), port_connections


def full_name(name: str, namespace: str) -> str:
    """Return the full name of a connection: absolute, or below the system's namespace."""
    return name if is_opaque(name) else join(namespace, name)


def connection_of(port: Port, port_connections: Iterable[PortConnection]) -> PortConnection | None:
    """Return the first connection of the port's kind, merged with others of the same name.

    A publisher in 'to' is not connected, nor is a subscription in 'from'.
    """
    is_source = port.kind is PortKind.PUBLISHER
    matching = [
        connection
        for connection in port_connections
        if connection.kind is port.kind.channel and connection.from_source in (None, is_source)
    ]
    if not matching:
        return None
    first = matching[0]
    same = [connection for connection in matching if connection.full_name == first.full_name]
    return PortConnection(
        first.kind,
        first.full_name,
        first.span,
        _first(connection.qos for connection in same),
        _first(connection.delivery for connection in same),
        _first(connection.isolation for connection in same),
    )


def _first(given: Iterable[T | None]) -> T | None:
    return next((value for value in given if value is not None), None)


def _connection(tree: Tree) -> Connection | None:
    if not isinstance(tree, Mapping):
        return None
    entry = _kind_entry(tree)
    name = text(entry.value) if entry is not None else None
    if entry is None or name is None:
        return None
    kind = ChannelKind(entry.name)
    sources, sinks = (
        tuple(Endpoint(name) for name in texts(tree.get(end))) for end in kind.keys_of_ends
    )
    return Connection(
        kind,
        name,
        sources,
        sinks,
        entry.key.span,
        qos=text(tree.get("qos")),
        delivery=choice(tree.get("delivery"), Delivery),
        isolation=choice(tree.get("isolation"), Isolation),
    )


def _kind_entry(tree: Mapping) -> Entry | None:
    kinds = {kind.value for kind in ChannelKind}
    return next((entry for entry in tree if entry.name in kinds), None)


def _profile(tree: Tree, kind: ChannelKind, qos: QosTable) -> Qos | None:
    written = tree.get("qos") if isinstance(tree, Mapping) else None
    if written is None:
        return None
    return qos.resolve(written, implicit_qos(kind, written.span))


def read_chains(tree: Tree | None) -> tuple[Chain, ...]:
    """Return the declared ``chains``, without those that lack a latency or ports."""
    found = (_chain(entry) for entry in entries(tree))
    return tuple(chain for chain in found if chain is not None)


def _chain(entry: Entry) -> Chain | None:
    tree = mapping(entry)
    latency_ms = number(tree.get("latency_ms"))
    endpoints = tuple(Endpoint(name) for name in texts(tree.get("through")))
    if latency_ms is None or not endpoints:
        return None
    return Chain(key(entry), endpoints, latency_ms, entry.key.span)
