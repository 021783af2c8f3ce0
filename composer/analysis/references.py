"""How a system refers to ports and to ROS names."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Endpoint, Node, Port, Remapping, System
from composer.names import expand_name


def endpoints(system: System) -> Iterator[Endpoint]:
    """Yield the ports that connections and chains refer to."""
    for connection in system.connections:
        yield from connection.sources
        yield from connection.sinks
    for chain in system.chains:
        yield from chain.through


def own_name(node: Node, name: str) -> str:
    """Return the full name of ``name`` in ``node`` before remapping."""
    return expand_name(name, node.name.value, node.namespace.value)


def matched_ports(node: Node, remapping: Remapping) -> Iterator[Port]:
    """Yield the ports whose declared name the remapping replaces."""
    source = own_name(node, remapping.source.value)
    for port in node.ports:
        if own_name(node, port.ros_name.value) == source:
            yield port
