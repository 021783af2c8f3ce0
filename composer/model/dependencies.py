"""Channels between nodes; dependencies: declared, implied by services and actions, and cycles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from heapq import heappop, heappush
from typing import TypeVar

from composer.base.fast_dataclass import dataclass
from composer.base.graphs import cycles, strong_groups
from composer.model.node import Node, PrimaryState
from composer.model.ports import ChannelKind, Port, PortKind
from composer.model.system import System

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class PortOfNode:
    """A port together with its node."""

    node: Node
    port: Port

    @property
    def key(self) -> tuple[str, str]:
        """The names of the node and of the port."""
        return self.node.name.value, self.port.name.value


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


def by_channel(
    ends: Iterable[tuple[PortKind, str, T]],
) -> Iterator[tuple[ChannelKind, str, tuple[T, ...], tuple[T, ...]]]:
    """Yield each topic, service and action with its sources and sinks, sorted by kind and name.

    ``ends`` are the kinds and names of ports, with what to yield for them.
    """
    found: dict[tuple[ChannelKind, str], tuple[list[T], list[T]]] = {}
    for kind, name, end in ends:
        found.setdefault((kind.channel, name), ([], []))[0 if kind.is_source else 1].append(end)
    for (channel, name), (sources, sinks) in sorted(found.items()):
        yield channel, name, tuple(sources), tuple(sinks)


def channels(nodes: Iterable[Node], *, with_transforms: bool = False) -> tuple[Channel, ...]:
    """Return all topics, services and actions of the nodes, sorted by kind and name.

    With transforms, /tf and /tf_static have the ports that follow from ``transforms``.
    """
    ends = (
        (port.kind, port.full_name, PortOfNode(node, port))
        for node in nodes
        for port in (node.all_ports if with_transforms else node.ports)
    )
    return tuple(Channel(*found) for found in by_channel(ends))


@dataclass(frozen=True, slots=True)
class DependencyEdge:
    """``node`` waits until ``on`` is in ``state``. Both are keys of ``System.nodes``.

    ``serves`` is the name of the service or action that ``on`` serves to ``node``; it is empty for
    a declared dependency. With ``is_container``, ``node`` is a component that ``on`` loads.
    """

    node: str
    on: str
    serves: str = ""
    state: PrimaryState = PrimaryState.ACTIVE
    is_container: bool = False

    @property
    def implied(self) -> bool:
        """True unless declared with ``depends_on``: servers start before their clients."""
        return bool(self.serves)


def declared_edges(system: System) -> Iterator[DependencyEdge]:
    """Yield the declared dependencies in order, without those on unknown nodes."""
    for node in system.nodes:
        for dependency in node.depends_on:
            if system.node(dependency.node.value) is not None:
                yield DependencyEdge(
                    node.name.value,
                    dependency.node.value,
                    state=dependency.state,
                    is_container=dependency.is_container,
                )


def implied_edges(system: System) -> Iterator[DependencyEdge]:
    """Yield an edge from every client of a service or action to its server.

    Of several servers, which the rules refuse, the first is used. There are no edges if the system
    disables implied dependencies.
    """
    if not system.implied_dependencies:
        return
    ends = (
        (port.kind, port.full_name, node.name.value)
        for node in system.nodes
        for port in node.ports
        if port.kind.channel is not ChannelKind.TOPIC
    )
    for _, name, servers, clients in by_channel(ends):
        for client in dict.fromkeys(clients) if servers else ():
            if client != servers[0]:
                yield DependencyEdge(client, servers[0], serves=name)


def dependency_edges(system: System) -> tuple[DependencyEdge, ...]:
    """Return all declared edges, then the implied ones that are not on a cycle.

    Nodes that serve each other have no order, and declared dependencies take precedence over
    implied ones.
    """
    return system.computed(_dependency_edges)


def _dependency_edges(system: System) -> tuple[DependencyEdge, ...]:
    declared = tuple(declared_edges(system))
    implied = tuple(implied_edges(system))
    group = {
        name: number
        for number, names in enumerate(strong_groups(_graph(system, declared + implied)))
        for name in names
    }
    return declared + tuple(edge for edge in implied if group[edge.node] != group[edge.on])


def needed_states(system: System) -> Mapping[str, Mapping[str, PrimaryState]]:
    """Return, for each node, the states that its dependencies must have: the higher of two."""
    needed: dict[str, dict[str, PrimaryState]] = {node.name.value: {} for node in system.nodes}
    for edge in dependency_edges(system):
        if needed[edge.node].get(edge.on) is not PrimaryState.ACTIVE:
            needed[edge.node][edge.on] = edge.state
    return needed


def dependency_cycles(system: System) -> tuple[tuple[str, ...], ...]:
    """Return a shortest cycle of ``depends_on`` for each set of nodes that wait for each other.

    ``("a", "b")`` means that a depends on b, which depends on a. Each cycle starts at its first
    declared node; cycles are ordered by these nodes.
    """
    return cycles(_graph(system, declared_edges(system)))


def in_dependency_order(system: System) -> tuple[str, ...]:
    """Return the names of all nodes in dependency order, else as declared.

    A cycle, which the rules refuse, is broken at its first declared node.
    """
    return system.computed(_in_dependency_order)


def _in_dependency_order(system: System) -> tuple[str, ...]:
    graph = _graph(system, dependency_edges(system))
    names = list(graph)
    rank = {name: index for index, name in enumerate(names)}
    waiting = {name: len(needed) for name, needed in graph.items()}
    dependents: dict[str, list[str]] = {name: [] for name in names}
    for name, needed in graph.items():
        for other in needed:
            dependents[other].append(name)
    ready = [rank[name] for name in names if not waiting[name]]
    placed: dict[str, None] = {}
    undecided = iter(names)
    while len(placed) < len(names):
        name = names[heappop(ready)] if ready else next(undecided)
        if name in placed:
            continue
        placed[name] = None
        for dependent in dependents[name]:
            waiting[dependent] -= 1
            if not waiting[dependent]:
                heappush(ready, rank[dependent])
    return tuple(placed)


def _graph(
    system: System, edges: Sequence[DependencyEdge] | Iterator[DependencyEdge]
) -> dict[str, dict[str, None]]:
    """Return the nodes that each node waits for, in order and without duplicates."""
    graph: dict[str, dict[str, None]] = {node.name.value: {} for node in system.nodes}
    for edge in edges:
        graph[edge.node][edge.on] = None
    return graph
