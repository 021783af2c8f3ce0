"""The endpoints of a topic, as the ROS graph reports them."""

from __future__ import annotations

from dataclasses import field
from typing import Any

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.base.fast_dataclass import dataclass
from composer.model.names import join_node_name
from composer.model.qos import QosProfile
from composer.runtime.ros.qos_profiles import discovered_profile

#: rmw's node name of an endpoint whose participant has not reported its nodes yet.
UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
#: The length of the participant's prefix in the id of an endpoint (DDSI-RTPS, 9.3.1).
PARTICIPANT_BYTES = 12


@dataclass(frozen=True, slots=True)
class EndpointInfo:
    """A publisher or a subscription of a node. ``gid`` and ``type_hash`` are spelled as in ros2.

    Endpoints that differ only in these two are equal.
    """

    node: str
    type: str
    qos: QosProfile
    gid: str = field(default="", compare=False)
    type_hash: str = field(default="", compare=False)

    @property
    def is_nameless(self) -> bool:
        """Whether the endpoint is discovered but its node is not."""
        return UNKNOWN_NODE in self.node

    @property
    def participant(self) -> bytes:
        """The prefix of the participant with the endpoint."""
        return bytes.fromhex(self.gid.replace(".", ""))[:PARTICIPANT_BYTES]

    @property
    def name(self) -> str:
        """The node's name, for messages."""
        return "a node whose name is unknown" if self.is_nameless else self.node

    def plain(self) -> dict[str, Any]:
        """Return the endpoint as data for JSON."""
        return {
            "node": self.node,
            "type": self.type,
            "type_hash": self.type_hash,
            "gid": self.gid,
            "qos": _announced(self.qos),
        }


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic and its endpoints."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[EndpointInfo, ...]
    subscriptions: tuple[EndpointInfo, ...]

    def plain(self) -> dict[str, Any]:
        """Return the topic and its endpoints as data for JSON."""
        return {
            "name": self.name,
            "types": list(self.types),
            "publishers": [item.plain() for item in self.publishers],
            "subscriptions": [item.plain() for item in self.subscriptions],
        }


def topic_info(node: Node, name: str, types: tuple[str, ...]) -> TopicInfo:
    """Return the endpoints of a topic, by its full name, that are discovered now."""
    return TopicInfo(
        name,
        types,
        _endpoints(node.get_publishers_info_by_topic(name)),
        _endpoints(node.get_subscriptions_info_by_topic(name)),
    )


def _announced(profile: QosProfile) -> dict[str, Any]:
    """Return the policies that are announced to other processes, without unset durations."""
    policies: dict[str, Any] = {
        "reliability": profile.reliability.value,
        "durability": profile.durability.value,
        "liveliness": profile.liveliness.value,
    }
    for name in ("deadline_ms", "lifespan_ms", "liveliness_lease_duration_ms"):
        value = getattr(profile, name)
        if value is not None:
            policies[name] = value
    return policies


def _endpoints(infos: list[TopicEndpointInfo]) -> tuple[EndpointInfo, ...]:
    return tuple(sorted(map(_endpoint, infos), key=lambda item: (item.node, item.type)))


def _endpoint(info: TopicEndpointInfo) -> EndpointInfo:
    node = join_node_name(info.node_namespace, info.node_name)
    return EndpointInfo(
        node,
        info.topic_type,
        discovered_profile(info.qos_profile),
        gid=".".join(f"{byte:02x}" for byte in info.endpoint_gid),
        type_hash=str(info.topic_type_hash),
    )
