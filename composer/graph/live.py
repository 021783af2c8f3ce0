"""From what was seen of a ROS graph to a scene."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from composer.drift import ObservedEndpoint, ObservedNode, Snapshot
from composer.graph.labels import qos_facts, told_qos_label
from composer.graph.namespaces import parent_of
from composer.graph.picture import Details
from composer.graph.scene import Actor, End, Scene
from composer.model import PortKind
from composer.tree import Plain

_TITLE = "ROS graph"


def scene_of(snapshot: Snapshot, rates_hz: Mapping[str, float]) -> Scene:
    """Return the nodes that were seen. ``rates_hz`` is how often messages came, by topic."""
    publishers = Counter(
        end.name
        for node in snapshot.nodes
        for end in node.endpoints
        if end.kind is PortKind.PUBLISHER
    )
    # Who of several sent what is not told: the rate is that of the topic then.
    alone = {topic: rate for topic, rate in rates_hz.items() if publishers[topic] == 1}
    return Scene(
        title=_TITLE,
        actors=tuple(_actor(node, alone) for node in snapshot.nodes if not node.is_hidden),
        rates_hz={topic: rate for topic, rate in rates_hz.items() if topic not in alone},
    )


def _actor(node: ObservedNode, rates_hz: Mapping[str, float]) -> Actor:
    ends = tuple(_ends(node, rates_hz))
    state = "state unknown" if node.state is None else node.state
    return Actor(
        name=node.full_name.rpartition("/")[2],
        full_name=node.full_name,
        namespace=parent_of(node.full_name),
        note=state,
        state=state,
        ends=ends,
        details=_facts(node, ends),
        wrong=f"{node.count} nodes have this name" if node.count > 1 else "",
    )


def _ends(node: ObservedNode, rates_hz: Mapping[str, float]) -> Iterator[End]:
    seen: Counter[tuple[PortKind, str]] = Counter()
    for end in node.endpoints:
        seen[end.kind, end.name] += 1
        number = seen[end.kind, end.name]
        rate = rates_hz.get(end.name) if end.kind is PortKind.PUBLISHER else None
        yield End(
            kind=end.kind,
            name=end.name if number == 1 else f"{end.name} ({number})",
            channel=end.name,
            interface=end.type,
            qos="" if end.qos is None else told_qos_label(end.qos),
            rate_hz=rate,
            details=_end_facts(end, rate),
        )


def _end_facts(end: ObservedEndpoint, rate_hz: float | None) -> Details:
    facts: dict[str, Plain] = {"kind": end.kind.value, "name": end.name, "type": end.type}
    if end.qos is not None:
        # History and depth are not told to other processes.
        told = qos_facts(end.qos).items()
        facts["qos"] = {name: value for name, value in told if name not in ("history", "depth")}
    if rate_hz is not None:
        facts["rate_hz"] = rate_hz
    return tuple(facts.items())


def _facts(node: ObservedNode, ends: tuple[End, ...]) -> Details:
    facts: dict[str, Plain] = {"full_name": node.full_name}
    if node.state != "":
        facts["state"] = node.state
    if ends:
        facts["ports"] = [dict(end.details) for end in ends]
    if node.parameters:
        facts["parameters"] = dict(node.parameters)
    return tuple(facts.items())
