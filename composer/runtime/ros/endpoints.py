"""The endpoints of a topic, as the ROS graph reports them."""

from __future__ import annotations

from dataclasses import dataclass, field

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from composer.qos import QosProfile
from composer.runtime.ros.qos_profiles import discovered_profile

#: rmw's node name of an endpoint whose participant has not reported its nodes yet.
UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"


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
    def name(self) -> str:
        """The node's name, for messages."""
        return "a node whose name is unknown" if self.is_nameless else self.node


@dataclass(frozen=True, slots=True)
class TopicInfo:
    """A topic and its endpoints."""

    name: str
    types: tuple[str, ...]
    publishers: tuple[EndpointInfo, ...]
    subscriptions: tuple[EndpointInfo, ...]


def topic_info(node: Node, name: str, types: tuple[str, ...]) -> TopicInfo:
    """Return the endpoints of a topic, by its full name, that are discovered now."""
    return TopicInfo(
        name,
        types,
        _endpoints(node.get_publishers_info_by_topic(name)),
        _endpoints(node.get_subscriptions_info_by_topic(name)),
    )


def _endpoints(infos: list[TopicEndpointInfo]) -> tuple[EndpointInfo, ...]:
    return tuple(sorted(map(_endpoint, infos), key=lambda item: (item.node, item.type)))


def _endpoint(info: TopicEndpointInfo) -> EndpointInfo:
    node = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
    return EndpointInfo(
        node,
        info.topic_type,
        discovered_profile(info.qos_profile),
        gid=".".join(f"{byte:02x}" for byte in info.endpoint_gid),
        type_hash=str(info.topic_type_hash),
    )
