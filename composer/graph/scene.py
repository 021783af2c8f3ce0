"""Scenes: nodes with their ports, either declared or discovered.

``declared`` builds scenes from systems, ``live`` from a ROS graph; views only read scenes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import chain, product
from typing import TypeVar

from composer.base.fast_dataclass import dataclass
from composer.graph.diagram import Cluster, Details, Edge, Problem
from composer.model import ChannelKind, PortKind
from composer.model.dependencies import by_channel

T = TypeVar("T")

#: Arrows for one channel in views that have no channels.
MAX_PAIRS = 400

#: Ports that send messages or requests: their arrows point to the channel.
SENDING = (PortKind.PUBLISHER, PortKind.CLIENT, PortKind.ACTION_CLIENT)


@dataclass(frozen=True, slots=True)
class ScenePort:
    """An endpoint of a node on a topic, service or action.

    ``name`` is the port's name (of a running node, the channel's); ``rate_hz`` is the publishing
    rate, None if unknown. ``qos`` is a short label, empty if not explicit.
    ``problem`` marks it.
    """

    kind: PortKind
    name: str
    channel: str
    interface: str
    qos: str = ""
    rate_hz: float | None = None
    details: Details = ()
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class SceneNode:
    """A node. ``full_name`` is unique in a scene.

    ``note`` is shown below the name. ``state`` is the current lifecycle state, or the state after
    bring-up; empty without one. ``steps`` are its bring-up steps. ``executor`` is the key of what
    runs it, empty if unknown.
    """

    name: str
    full_name: str
    namespace: str
    note: str = ""
    state: str = ""
    steps: str = ""
    executor: str = ""
    ports: tuple[ScenePort, ...] = ()
    details: Details = ()
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class SceneTransform:
    """A transform that a node broadcasts, on ``topic`` or the static topic that belongs to it."""

    topic: str
    parent: str
    child: str
    kind: str  # static or dynamic
    node: str  # full name
    details: Details = ()
    problem: Problem | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything to draw.

    ``waits`` are the dependencies: arrows from a node to those that wait for it. ``executors`` are
    what runs nodes: executors, processes, and hosts around processes. ``rates_hz`` are the
    measured rates of topics with several publishers. ``is_live`` is whether the states of nodes are
    observed.
    """

    title: str
    nodes: tuple[SceneNode, ...]
    waits: tuple[Edge, ...] = ()
    executors: tuple[Cluster, ...] = ()
    transforms: tuple[SceneTransform, ...] = ()
    rates_hz: Mapping[str, float] = field(default_factory=dict)
    is_live: bool = False


@dataclass(frozen=True, slots=True)
class SceneEndpoint:
    """A port together with its node."""

    node: SceneNode
    port: ScenePort


@dataclass(frozen=True, slots=True)
class SceneChannel:
    """A topic, service or action with its endpoints."""

    kind: ChannelKind
    name: str
    sources: tuple[SceneEndpoint, ...]  # publishers or servers
    sinks: tuple[SceneEndpoint, ...]  # subscriptions or clients

    @property
    def endpoints(self) -> tuple[SceneEndpoint, ...]:
        """All endpoints, sources first."""
        return self.sources + self.sinks

    @property
    def types(self) -> tuple[str, ...]:
        """The interface types of all endpoints, normally a single one."""
        return tuple(dict.fromkeys(endpoint.port.interface for endpoint in self.endpoints))


def channels(nodes: Iterable[SceneNode]) -> tuple[SceneChannel, ...]:
    """Return all topics, services and actions of the nodes, sorted by kind and name."""
    ends = (
        (port.kind, port.channel, SceneEndpoint(node, port))
        for node in nodes
        for port in node.ports
    )
    return tuple(SceneChannel(*found) for found in by_channel(ends))


def drawn_pairs(sources: Sequence[T], sinks: Sequence[T]) -> Iterator[tuple[T, T]]:
    """Yield each source with each sink; of more than MAX_PAIRS, those with the first of either."""
    if len(sources) * len(sinks) <= MAX_PAIRS:
        return product(sources, sinks)
    return chain(product(sources[:1], sinks), product(sources[1:], sinks[:1]))


def node_key(node: SceneNode) -> str:
    """Return the key of a node."""
    return f"node:{node.full_name}"


def port_key(node: SceneNode, port: ScenePort) -> str:
    """Return the key of a port.

    The kind is part of it: a running node may have a publisher and a subscription with one name.
    """
    return f"{port.kind.value.replace(' ', '_')}:{node.full_name}.{port.name}"


def channel_key(channel: SceneChannel) -> str:
    """Return the key of a topic, service or action."""
    return f"{channel.kind}:{channel.name}"
