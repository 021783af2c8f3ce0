"""Build a scene from a snapshot of a ROS graph."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from composer.graph.diagram import Cluster, Details, Problem, parent_of
from composer.graph.facts import discovered_qos_facts, discovered_qos_label
from composer.graph.scene import Scene, SceneNode, ScenePort
from composer.language.document.scalars import with_json_numbers
from composer.language.tree import Plain
from composer.model import PortKind
from composer.plan.drift import ObservedEndpoint, ObservedNode, ObservedProcess, Snapshot

_TITLE = "ROS graph"


def live_scene_of(snapshot: Snapshot, rates_hz: Mapping[str, float]) -> Scene:
    """Return the scene of a snapshot. ``rates_hz`` are measured rates by topic."""
    publishers = Counter(
        endpoint.name
        for node in snapshot.nodes
        for endpoint in node.endpoints
        if endpoint.kind is PortKind.PUBLISHER
    )
    # With several publishers, the rate is that of the topic: the senders are unknown.
    alone = {topic: rate for topic, rate in rates_hz.items() if publishers[topic] == 1}
    groups = {node: _key(process) for process in snapshot.processes for node in process.nodes}
    return Scene(
        title=_TITLE,
        nodes=tuple(
            _scene_node(node, alone, groups.get(node.full_name, ""))
            for node in snapshot.nodes
            if not node.is_hidden
        ),
        executors=tuple(_groups(snapshot)),
        rates_hz={topic: rate for topic, rate in rates_hz.items() if topic not in alone},
        is_live=True,
    )


def _groups(snapshot: Snapshot) -> Iterator[Cluster]:
    """Return hosts and their processes, as far as nodes of them are drawn."""
    drawn = {node.full_name for node in snapshot.nodes if not node.is_hidden}
    processes = [process for process in snapshot.processes if drawn.intersection(process.nodes)]
    for host in sorted({process.host for process in processes if process.host}):
        yield Cluster(f"host:{host}", f"host {host}")
    for process in processes:
        number = f": process {process.pid}" if process.pid else ": no response"
        parent = f"host:{process.host}" if process.host else ""
        yield Cluster(_key(process), f"{process.name}{number}", parent)


def _key(process: ObservedProcess) -> str:
    return f"process:{process.name}"


def _scene_node(node: ObservedNode, rates_hz: Mapping[str, float], group: str) -> SceneNode:
    ports = tuple(_ports(node, rates_hz))
    state = "state unknown" if node.state is None else node.state
    return SceneNode(
        name=node.full_name.rpartition("/")[2],
        full_name=node.full_name,
        namespace=parent_of(node.full_name),
        note=state,
        state=state,
        executor=group,
        ports=ports,
        details=_facts(node, ports),
        problem=Problem(f"{node.count} nodes have this name") if node.count > 1 else None,
    )


def _ports(node: ObservedNode, rates_hz: Mapping[str, float]) -> Iterator[ScenePort]:
    seen: Counter[tuple[PortKind, str]] = Counter()
    for endpoint in node.endpoints:
        seen[endpoint.kind, endpoint.name] += 1
        number = seen[endpoint.kind, endpoint.name]
        rate = rates_hz.get(endpoint.name) if endpoint.kind is PortKind.PUBLISHER else None
        yield ScenePort(
            kind=endpoint.kind,
            name=endpoint.name if number == 1 else f"{endpoint.name} ({number})",
            channel=endpoint.name,
            interface=endpoint.type,
            qos="" if endpoint.qos is None else discovered_qos_label(endpoint.qos),
            rate_hz=rate,
            details=_endpoint_facts(endpoint, rate),
        )


def _endpoint_facts(endpoint: ObservedEndpoint, rate_hz: float | None) -> Details:
    facts: dict[str, Plain] = {
        "kind": endpoint.kind.value,
        "name": endpoint.name,
        "type": endpoint.type,
    }
    if endpoint.qos is not None:
        facts["qos"] = discovered_qos_facts(endpoint.qos)
    if rate_hz is not None:
        facts["rate_hz"] = rate_hz
    return tuple(facts.items())


def _facts(node: ObservedNode, ports: tuple[ScenePort, ...]) -> Details:
    facts: dict[str, Plain] = {"full_name": node.full_name}
    if node.state != "":
        facts["state"] = node.state
    if ports:
        facts["ports"] = [dict(port.details) for port in ports]
    if node.parameters:
        facts["parameters"] = with_json_numbers(node.parameters)
    return tuple(facts.items())
