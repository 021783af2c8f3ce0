"""The running ROS graph: discovery, and the compatibility of endpoints."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import product

from rclpy.context import Context
from rclpy.node import Node
from rclpy.utilities import get_rmw_implementation_identifier

from composer.client.doctor import CheckResult, error, note, ok, warning
from composer.client.graph_names import GraphNames
from composer.client.session import Deadline, Session
from composer.model.qos import incompatibilities
from composer.runtime.intra_process.dds_flags import unsupported_reason
from composer.runtime.middleware.environment import ROS_ARGUMENTS
from composer.runtime.ros.endpoints import EndpointInfo, TopicInfo, topic_info
from composer.runtime.ros.messages import MessageError, interface_class

_TESTED_MIDDLEWARE = "rmw_fastrtps_cpp"
#: Fast DDS repeats the announcement of a participant every 3 s.
_DISCOVERY_S = 4.0


def check_middleware() -> CheckResult:
    """Check the RMW implementation."""
    used = get_rmw_implementation_identifier()
    if used == _TESTED_MIDDLEWARE:
        return ok("middleware", used)
    return note(
        "middleware",
        f"{used} is in use; ros2-composer is tested with {_TESTED_MIDDLEWARE}",
        f"if there are problems, set RMW_IMPLEMENTATION={_TESTED_MIDDLEWARE} for all processes",
    )


def check_delivery(session: Session) -> CheckResult:
    """Check whether messages within a process can bypass the middleware."""
    reason = unsupported_reason(session.node.context)
    if reason is None:
        return ok("delivery", "messages within a process bypass the middleware")
    return note(
        "delivery",
        f"messages within a process go through the middleware, which is slower: {reason}",
        f"use {_TESTED_MIDDLEWARE} of ROS 2 Jazzy, or set 'delivery: dds' in the system",
    )


def check_discovery(session: Session, deadline: Deadline) -> CheckResult:
    """Start a second participant and check that it is discovered."""
    name = f"_compose_doctor_{os.getpid()}"
    context = Context()
    context.init(list(ROS_ARGUMENTS))
    limit = deadline.at_most(_DISCOVERY_S)
    started_s = time.monotonic()
    try:
        node = Node(name, context=context, use_global_arguments=False)
        discovered = session.wait_for(
            lambda: name in {known for known, _ in session.graph.nodes()}, limit
        )
        node.destroy_node()
    finally:
        context.try_shutdown()
    took_s = time.monotonic() - started_s
    server = os.environ.get("ROS_DISCOVERY_SERVER")
    through = f" through the discovery server {server}" if server else ""
    if discovered:
        text = f"two participants discovered each other within {took_s:.1f} s{through}"
        return ok("discovery", text)
    remedy = (
        "unset ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_DISCOVERY_SERVER and Fast DDS profiles; if that"
        " does not help, check the firewall and the network"
    )
    if server:
        remedy = "start the server ('fastdds discovery'), and allow UDP to its port in firewalls"
    return error(
        "discovery",
        "two participants on this computer did not discover each other within"
        f" {took_s:.1f} s{through}",
        remedy,
    )


def check_graph(session: Session, deadline: Deadline) -> Iterator[CheckResult]:
    """Check names, types and QoS profiles of all nodes in the graph."""
    names = GraphNames(session, deadline)
    nodes = [name for name, _ in names.names("node")]
    if not nodes:
        yield note(
            "graph",
            "no nodes found",
            "start one ('compose run pipeline') in a terminal with the same ROS_DOMAIN_ID",
        )
        return
    topics = [topic_info(session.graph.node, *named) for named in names.names("topic")]
    services = names.names("service")
    problems = [
        *check_node_names(nodes),
        *(result for topic in topics for result in check_endpoints(topic)),
        *check_types("service", services),
        *check_types_built(
            [("topic", item.name, item.types) for item in topics]
            + [("service", name, types) for name, types in services]
        ),
    ]
    yield from problems
    if not problems:
        counted = f"{len(nodes)} nodes, {len(topics)} topics, {len(services)} services"
        yield ok("graph", f"all endpoints are compatible: {counted}")


def check_node_names(names: Iterable[str]) -> Iterator[CheckResult]:
    """Yield a warning for each name that more than one node has."""
    for name, count in Counter(names).items():
        if count > 1:
            yield warning(
                "graph",
                f"{count} nodes have the name {name}: service calls reach an arbitrary one",
                "rename one, change its namespace (compose run --namespace /other), or end a"
                " process that was left running",
            )


def check_endpoints(topic: TopicInfo) -> Iterator[CheckResult]:
    """Yield an error for each publisher and subscription that do not match."""
    yield from check_types("topic", [(topic.name, topic.types)])
    seen = set()
    for publisher, subscription in product(topic.publishers, topic.subscriptions):
        pair = (publisher, subscription)
        if publisher.type == subscription.type and pair not in seen:
            seen.add(pair)
            yield from _check_pair(topic.name, publisher, subscription)


def check_types(kind: str, named: Iterable[tuple[str, tuple[str, ...]]]) -> Iterator[CheckResult]:
    """Yield an error for each topic or service with more than one type."""
    for name, types in named:
        if len(types) > 1:
            yield error(
                "graph",
                f"{kind} {name} has more than one type: {', '.join(types)}",
                f"find the nodes ('compose {kind} {'info -v' if kind == 'topic' else 'type'}"
                f" {name}') and rename one of the {kind}s",
            )


def check_types_built(used: Iterable[tuple[str, str, tuple[str, ...]]]) -> Iterator[CheckResult]:
    """Yield a warning for each type in ``used``, (kind, name, types), that cannot be imported."""
    first_use: dict[str, str] = {}
    for kind, name, types in used:
        for type_name in types:
            first_use.setdefault(type_name, f"{kind} {name}")
    for type_name, use in first_use.items():
        try:
            interface_class(type_name)
        except MessageError:
            yield warning(
                "interfaces",
                f"{type_name} ({use}) is not installed: it cannot be used on this computer",
                f"install or build the package '{type_name.split('/')[0]}' and source it",
            )


def _check_pair(
    topic: str, publisher: EndpointInfo, subscription: EndpointInfo
) -> Iterator[CheckResult]:
    for mismatch in incompatibilities(publisher.qos, subscription.qos):
        yield error(
            "qos",
            f"{topic}: {publisher.node} offers {mismatch.policy} {mismatch.offered},"
            f" {subscription.node} requests {mismatch.requested}: no messages are delivered",
            f"make {subscription.node} request {mismatch.offered}, or make {publisher.node} offer"
            f" {mismatch.requested}",
        )
