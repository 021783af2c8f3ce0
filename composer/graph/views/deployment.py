"""Who runs what: executors as frames around their nodes, and what passes between nodes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.graph.facts import node_facts
from composer.graph.findings import Findings
from composer.graph.picture import Cluster, Direction, Edge, Graph, Kind, Line, Vertex
from composer.model import ChannelKind, Executor, ExecutorKind, Node, System, channels

_DEFAULT = "default"


def build(system: System, findings: Findings) -> Graph:
    """Return the graph of executors, each with the nodes whose callbacks it calls."""
    return Graph(
        title=system.name.value,
        view="deployment",
        direction=Direction.RIGHT,
        vertices=tuple(_node(node, findings) for node in system.nodes),
        edges=tuple(_edges(system)),
        clusters=tuple(_clusters(system)),
    )


def _node(node: Node, findings: Findings) -> Vertex:
    return Vertex(
        key=f"node:{node.name.value}",
        kind=Kind.NODE,
        lines=(node.full_name,),
        cluster=_cluster_key(_executor_name(node)),
        details=node_facts(node),
        wrong=findings.about_node(node),
    )


def _executor_name(node: Node) -> str:
    return node.executor.value if node.executor is not None else _DEFAULT


def _cluster_key(executor: str) -> str:
    return f"executor:{executor}"


def _clusters(system: System) -> Iterator[Cluster]:
    declared = {executor.name.value: executor for executor in system.executors}
    for name in dict.fromkeys([*declared, *map(_executor_name, system.nodes)]):
        yield Cluster(_cluster_key(name), f"{name}: {_kind(declared.get(name))}")


def _kind(executor: Executor | None) -> str:
    if executor is None:
        return ExecutorKind.EVENTS.value
    if executor.kind is ExecutorKind.MULTI_THREADED:
        return f"{executor.kind}, {executor.threads} threads"
    return executor.kind.value


def _edges(system: System) -> Iterator[Edge]:
    """One arrow for all that goes from one node to another in one way."""
    names: dict[tuple[str, str, ChannelKind], list[str]] = {}
    for channel in channels(system.nodes):
        for source in channel.sources:
            for sink in channel.sinks:
                ends = (source.node.name.value, sink.node.name.value)
                if channel.kind is not ChannelKind.TOPIC:
                    ends = ends[::-1]
                names.setdefault((*ends, channel.kind), []).append(channel.name)
    for (begin, end, kind), joined in sorted(names.items()):
        yield Edge(f"node:{begin}", f"node:{end}", Line(kind.value), tuple(dict.fromkeys(joined)))
