"""Topics, services and actions, with the ports that use them."""

from __future__ import annotations

from collections.abc import Iterable

from composer.base.fast_dataclass import dataclass
from composer.model.ports import ChannelKind, Port, PortKind
from composer.model.system import Node


@dataclass(frozen=True, slots=True)
class PortOfNode:
    """A port together with its node."""

    node: Node
    port: Port


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic, service or action with all ports of the system that use it."""

    kind: ChannelKind
    name: str
    sources: tuple[PortOfNode, ...]  # publishers or servers
    sinks: tuple[PortOfNode, ...]  # subscriptions or clients

    @property
    def ends(self) -> tuple[PortOfNode, ...]:
        """All ports of the channel, sources first."""
        return self.sources + self.sinks


_SOURCES = (PortKind.PUBLISHER, PortKind.SERVICE, PortKind.ACTION_SERVER)


def channels(nodes: Iterable[Node], *, with_transforms: bool = False) -> tuple[Channel, ...]:
    """Return all topics, services and actions of the nodes, sorted by kind and name.

    With transforms, /tf and /tf_static have the ports that follow from ``transforms``.
    """
    ends: dict[tuple[ChannelKind, str], list[PortOfNode]] = {}
    for node in nodes:
        for port in node.all_ports if with_transforms else node.ports:
            ends.setdefault((port.kind.channel, port.full_name), []).append(PortOfNode(node, port))
    return tuple(
        Channel(
            kind,
            name,
            tuple(end for end in joined if end.port.kind in _SOURCES),
            tuple(end for end in joined if end.port.kind not in _SOURCES),
        )
        for (kind, name), joined in sorted(ends.items())
    )
