"""Who is at the ends of a topic, as the ROS graph tells it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.qos import Durability, History, Liveliness, QosProfile, Reliability

#: rmw's infinite duration; what is longer than any process lives means "no limit".
_NO_LIMIT_MS = 1e12
#: What rmw calls the node of an endpoint as long as its participant has not told of it.
NO_NAME = "_NODE_NAME_UNKNOWN_"


@dataclass(frozen=True, slots=True)
class End:
    """A publisher or a subscription of some node."""

    node: str
    type: str
    qos: QosProfile

    @property
    def is_nameless(self) -> bool:
        """Whether the endpoint is known, but not yet whose it is."""
        return NO_NAME in self.node

    @property
    def name(self) -> str:
        """The node's name, for people."""
        return "a node whose name is unknown" if self.is_nameless else self.node


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic and who is at its ends."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[End, ...]
    subscriptions: tuple[End, ...]


def topic_info(node: Node, name: str, types: tuple[str, ...]) -> TopicInfo:
    """Return who is known now to publish and subscribe to a topic, by its full name."""
    return TopicInfo(
        name,
        types,
        _ends(node.get_publishers_info_by_topic(name)),
        _ends(node.get_subscriptions_info_by_topic(name)),
    )


def _ends(endpoints: list[TopicEndpointInfo]) -> tuple[End, ...]:
    return tuple(sorted(map(_end, endpoints), key=lambda end: (end.node, end.type)))


def _end(endpoint: TopicEndpointInfo) -> End:
    node = f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
    return End(node, endpoint.topic_type, _profile(endpoint.qos_profile))


def _profile(found: QoSProfile) -> QosProfile:
    """Return a profile as we say it. History and depth are not discovered: they say nothing."""
    profile = QosProfile(
        reliability=(
            Reliability.BEST_EFFORT
            if found.reliability is ReliabilityPolicy.BEST_EFFORT
            else Reliability.RELIABLE
        ),
        durability=(
            Durability.TRANSIENT_LOCAL
            if found.durability is DurabilityPolicy.TRANSIENT_LOCAL
            else Durability.VOLATILE
        ),
        deadline_ms=_milliseconds(found.deadline),
        lifespan_ms=_milliseconds(found.lifespan),
        liveliness=(
            Liveliness.MANUAL_BY_TOPIC
            if found.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
            else Liveliness.AUTOMATIC
        ),
        liveliness_lease_duration_ms=_milliseconds(found.liveliness_lease_duration),
    )
    if found.history is HistoryPolicy.KEEP_ALL:
        return replace(profile, history=History.KEEP_ALL)
    return profile


def _milliseconds(duration: Any) -> float | None:
    milliseconds = duration.nanoseconds / 1e6
    return None if milliseconds >= _NO_LIMIT_MS else milliseconds
