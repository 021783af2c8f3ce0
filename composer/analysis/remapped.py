"""Which ports a remapping is about."""

from __future__ import annotations

from collections.abc import Iterator

from composer.model import Node, Port, Remapping
from composer.names import expand_name


def own_name(node: Node, name: str) -> str:
    """Return ``name`` as it is in ``node`` before any remapping."""
    return expand_name(name, node.name.value, node.namespace.value)


def matched_ports(node: Node, remapping: Remapping) -> Iterator[Port]:
    """Yield the ports whose declared name the remapping names."""
    source = own_name(node, remapping.source.value)
    for port in node.ports:
        if own_name(node, port.ros_name.value) == source:
            yield port
