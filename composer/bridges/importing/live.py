"""Describe the nodes of the ROS graph."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any

from composer.bridges.importing import FoundNode, FoundParameter, FoundPort, FoundSystem
from composer.language.tree import Plain
from composer.model import USE_SIM_TIME, PortKind
from composer.model.names import is_selected, split_node_name, topic_name_problem
from composer.model.qos import DURATIONS, PRESETS, QosProfile
from composer.model.resolve.parameters import rclpy_type
from composer.plan.drift import ObservedEndpoint, ObservedNode, Snapshot, is_manager

#: Parameters that rclpy and rclcpp declare for each node.
_OF_EVERY_NODE = ("start_type_description_service", "qos_overrides.")
#: The primary states below active.
_LOW_STATES = ("unconfigured", "inactive")
#: Of the profiles that look the same in the ROS graph, the one that is most likely meant.
_LIKELY = (PRESETS["sensor_data"], PRESETS["state"])


def describe_graph(
    name: str,
    snapshot: Snapshot,
    settings: Mapping[str, Mapping[str, Mapping[str, Plain]]],
    known_types: Collection[str],
    selected: Iterable[str] = (),
) -> FoundSystem:
    """Return the nodes of a snapshot whose names match ``selected``, by default all.

    ``settings`` are the descriptions of parameters, by node and parameter: ``type``,
    ``description``, ``minimum`` ... Endpoints with types that are not in ``known_types`` are left
    out. Hidden nodes and manager nodes of the composer are not described.
    """
    left_out: list[str] = []
    nodes = [node for node in snapshot.nodes if _is_selected(node, tuple(selected))]
    ends = {(end.kind, end.name) for node in nodes for end in node.endpoints}
    found = []
    for node in nodes:
        if node.count > 1:
            left_out.append(f"{node.count - 1} more nodes with the name {node.full_name}")
        ports = tuple(_ports(node, ends, known_types, left_out))
        parameters = tuple(_parameters(node, settings.get(node.full_name, {}), left_out))
        namespace, last = split_node_name(node.full_name)
        found.append(
            FoundNode(
                name=last,
                namespace=namespace,
                keys=_keys(node),
                ports=ports,
                parameters=parameters,
                comments=_node_comments(node),
            )
        )
    comments = (
        "Imported from the ROS graph by 'compose import live'.",
        "The ROS graph does not show the depth of queues.",
    )
    return FoundSystem(name, tuple(found), comments, tuple(left_out))


def _is_selected(node: ObservedNode, selected: tuple[str, ...]) -> bool:
    if node.is_hidden or is_manager(node.full_name, node.endpoints):
        return False
    return not selected or any(is_selected(node.full_name, target) for target in selected)


def _ports(
    node: ObservedNode,
    ends: Collection[tuple[PortKind, str]],
    known_types: Collection[str],
    left_out: list[str],
) -> Iterable[FoundPort]:
    seen: set[tuple[PortKind, str, QosProfile | None]] = set()
    for end in node.endpoints:
        what = f"{end.kind} {end.name} of {node.full_name}"
        if topic_name_problem(end.name):
            left_out.append(f"{what}: the name {topic_name_problem(end.name)}")
        elif end.type not in known_types:
            left_out.append(f"{what}: its type {end.type} is not known here")
        elif (end.kind, end.name, end.qos) not in seen:
            seen.add((end.kind, end.name, end.qos))
            is_alone = (end.kind.counterpart, end.name) not in ends
            yield FoundPort(end.kind, end.name, end.type, _qos(end), external=is_alone)


def _qos(end: ObservedEndpoint) -> QosProfile | None:
    """Return the profile of an endpoint with a likely queue: discovery does not report it."""
    if end.qos is None:
        return None
    for likely in _LIKELY:
        if _without_queue(likely) == _without_queue(end.qos):
            return likely
    return _without_queue(end.qos)


def _without_queue(profile: QosProfile) -> QosProfile:
    default = QosProfile()
    durations: dict[str, Any] = {name: getattr(profile, name) or None for name in DURATIONS}
    return replace(profile, history=default.history, depth=default.depth, **durations)


def _parameters(
    node: ObservedNode, settings: Mapping[str, Mapping[str, Plain]], left_out: list[str]
) -> Iterable[FoundParameter]:
    if node.parameters is None:
        left_out.append(f"parameters of {node.full_name}: it did not respond")
        return
    for name, value in node.parameters.items():
        if name.startswith(_OF_EVERY_NODE) or (name == USE_SIM_TIME and not value):
            continue
        described = dict(settings.get(name, {}))
        kind = described.pop("type", None) or rclpy_type(value)
        if kind is None or value is None:
            left_out.append(f"parameter {name} of {node.full_name}: it has no value")
        else:
            yield FoundParameter(name, str(kind), value, described)


def _keys(node: ObservedNode) -> dict[str, Plain]:
    """Return the keys of an external node, which stays in the state that it has."""
    keys: dict[str, Plain] = {"external": True}
    if node.state in _LOW_STATES:
        keys["lifecycle"] = {"autostart": node.state}
    return keys


def _node_comments(node: ObservedNode) -> tuple[str, ...]:
    comments = []
    if node.state is None:
        comments.append("A lifecycle node that did not respond.")
    if node.container:
        comments.append(
            f"Loaded by {node.container}; with 'component' and 'container', a system loads it."
        )
    return tuple(comments)
