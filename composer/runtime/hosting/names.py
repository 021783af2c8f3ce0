"""The names that a class uses, and those that its node declares, connects or remaps them to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from composer.model import ChannelKind, Node, PortKind
from composer.model.names import expand_name

#: How rcl names the channel of a remapping rule.
_SCHEMES = {ChannelKind.TOPIC: "rostopic", ChannelKind.SERVICE: "rosservice"}


def remapping_arguments(node: Node) -> list[str]:
    """Return the command-line arguments that give rcl the names of the node's topics and services.

    As with ``ros2 run --ros-args -r``, the first matching rule counts: connections come before
    remappings.
    """
    written = (f"{item.source}:={item.target}" for item in node.remappings)
    rules = [*_connected(node), *written]
    words = [word for rule in dict.fromkeys(rules) for word in ("-r", rule)]
    return ["--ros-args", *words] if words else []


def action_names(node: Node) -> Mapping[tuple[PortKind, str], str]:
    """Return the full names of actions by their kind and the expanded name: rcl remaps none."""
    found: dict[tuple[PortKind, str], str] = {}
    for port in node.ports_of(PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
        found.setdefault((port.kind, _expanded(node, port.ros_name.value)), port.full_name)
    for remapping in node.remappings:
        for kind in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):
            source = _expanded(node, remapping.source.value)
            found.setdefault((kind, source), _expanded(node, remapping.target.value))
    return found


def _connected(node: Node) -> Iterator[str]:
    for port in node.ports:
        scheme = _SCHEMES.get(port.kind.channel)
        own = _expanded(node, port.ros_name.value)
        if scheme is not None and own != port.full_name:
            yield f"{scheme}://{own}:={port.full_name}"


def _expanded(node: Node, name: str) -> str:
    return expand_name(name, node.ros_name.value, node.namespace.value)
