"""The part of the ROS graph that is of the pipeline's nodes."""

from __future__ import annotations

from contextlib import suppress

from rclpy.node import Node, NodeNameNonExistentError
from rclpy.topic_endpoint_info import TopicEndpointInfo

from tests.ros.support.pipeline import NODES
from tests.ros.support.system_process import ExternalNode

#: The number of looks at the graph without a change: more than a second, in which a busy machine
#: may not run a process.
STABLE = 30

Graph = frozenset[tuple[str, ...]]


def graph_of(node: Node) -> Graph:
    """Return the endpoints of the pipeline's nodes: kind, node, name, type, QoS."""
    found: set[tuple[str, ...]] = set()
    for topic, _ in node.get_topic_names_and_types():
        for endpoint in node.get_publishers_info_by_topic(topic):
            found.add(("publisher", *_endpoint(topic, endpoint)))
        for endpoint in node.get_subscriptions_info_by_topic(topic):
            found.add(("subscription", *_endpoint(topic, endpoint)))
    for full_name in NODES:
        namespace, _, name = full_name.rpartition("/")
        with suppress(NodeNameNonExistentError):
            for service, types in node.get_service_names_and_types_by_node(name, namespace):
                found.add(("service", full_name, service, *types))
            for service, types in node.get_client_names_and_types_by_node(name, namespace):
                found.add(("client", full_name, service, *types))
    return frozenset(entry for entry in found if entry[1] in NODES)


def _endpoint(topic: str, endpoint: TopicEndpointInfo) -> tuple[str, ...]:
    qos = endpoint.qos_profile
    name = f"{endpoint.node_namespace}/{endpoint.node_name}"
    policies = (qos.reliability, qos.durability, qos.deadline, qos.lifespan, qos.liveliness)
    return (name, topic, endpoint.topic_type, *map(str, policies))


def stable_graph(observer: ExternalNode) -> Graph:
    """Return the graph once it has stopped to change."""
    seen: list[Graph] = []

    def is_stable() -> bool:
        seen.append(graph_of(observer.node))
        last = seen[-STABLE:]
        return len(last) == STABLE and len(set(last)) == 1 and bool(last[-1])

    observer.spin_until(is_stable)
    return seen[-1]
