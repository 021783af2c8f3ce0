"""The live ROS graph: whether participants meet and the ends of topics and services fit."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import product

from rclpy.context import Context
from rclpy.node import Node
from rclpy.utilities import get_rmw_implementation_identifier

from composer.doctor.finding import Finding, error, fine, note, warning
from composer.qos import incompatibilities
from composer.remote.graph_names import Names
from composer.remote.session import Deadline, Session
from composer.runtime.intra_process.ignore_local_publications import why_not_ignored
from composer.runtime.ros.endpoints import End, TopicInfo, topic_info
from composer.runtime.ros.messages import MessageError, interface_class

_TESTED_MIDDLEWARE = "rmw_fastrtps_cpp"
#: Fast DDS announces a participant anew every 3 s.
_MEETING_S = 4.0


def look_at_middleware() -> Finding:
    """Say which middleware is used."""
    used = get_rmw_implementation_identifier()
    if used == _TESTED_MIDDLEWARE:
        return fine("middleware", used)
    return note(
        "middleware",
        f"{used} is used; the composer is tested with {_TESTED_MIDDLEWARE}",
        f"set RMW_IMPLEMENTATION={_TESTED_MIDDLEWARE} for all processes where something is odd",
    )


def look_at_delivery(session: Session) -> Finding:
    """Say whether messages between the nodes of one process can stay there."""
    reason = why_not_ignored(session.node.context)
    if reason is None:
        return fine("delivery", "messages within a process can go past the middleware")
    return note(
        "delivery",
        f"messages within a process go through the middleware, which costs more: {reason}",
        f"use {_TESTED_MIDDLEWARE} of ROS 2 Jazzy, or say 'delivery: dds' in the system",
    )


def look_at_discovery(session: Session, deadline: Deadline) -> Finding:
    """Start a second participant and see whether the two meet."""
    name = f"_compose_doctor_{os.getpid()}"
    context = Context()
    context.init([])
    patience = Deadline(min(_MEETING_S, deadline.left_s))
    began_s = time.monotonic()
    try:
        node = Node(name, context=context, use_global_arguments=False)
        met = session.wait_for(lambda: name in session.node.get_node_names() or None, patience)
        node.destroy_node()
    finally:
        context.try_shutdown()
    took_s = time.monotonic() - began_s
    if met:
        return fine("discovery", f"two participants met after {took_s:.1f} s")
    return error(
        "discovery",
        f"two participants on this computer did not meet within {took_s:.1f} s",
        "unset ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_DISCOVERY_SERVER and Fast DDS profiles; if that"
        " helps, one of them is it, if not, the firewall or the network is",
    )


def look_at_graph(session: Session, deadline: Deadline) -> Iterator[Finding]:
    """Yield what does not fit in the graph, whoever's nodes are in it."""
    names = Names(session, deadline)
    nodes = names.nodes()
    if not nodes:
        yield note(
            "graph",
            "no node was found",
            "start one ('compose run pipeline') in a terminal with the same ROS_DOMAIN_ID",
        )
        return
    topics = [topic_info(session.node, *named) for named in names.topics()]
    services = names.services()
    found = [
        *repeated_nodes(nodes),
        *(finding for topic in topics for finding in unfit_ends(topic)),
        *several_types("service", services),
        *unbuilt_types(
            [("topic", item.name, item.types) for item in topics]
            + [("service", name, types) for name, types in services]
        ),
    ]
    yield from found
    if not found:
        counted = f"{len(nodes)} nodes, {len(topics)} topics, {len(services)} services"
        yield fine("graph", f"all ends fit: {counted}")


def repeated_nodes(names: Iterable[str]) -> Iterator[Finding]:
    """Yield the names that more than one node has."""
    for name, count in Counter(names).items():
        if count > 1:
            yield warning(
                "graph",
                f"{count} nodes are called {name}: services and parameters reach any of them",
                "give one of them another name or namespace (compose run --namespace /other),"
                " or end the process that was left behind",
            )


def unfit_ends(topic: TopicInfo) -> Iterator[Finding]:
    """Yield the publishers and subscriptions of a topic between which nothing goes."""
    yield from several_types("topic", [(topic.name, topic.types)])
    seen = set()
    for publisher, subscription in product(topic.publishers, topic.subscriptions):
        pair = (publisher, subscription)
        if publisher.type == subscription.type and pair not in seen:
            seen.add(pair)
            yield from _unfit_pair(topic.name, publisher, subscription)


def several_types(kind: str, named: Iterable[tuple[str, tuple[str, ...]]]) -> Iterator[Finding]:
    """Yield the topics or services that have more than one type."""
    for name, types in named:
        if len(types) > 1:
            yield error(
                "graph",
                f"{kind} {name} has more than one type: {', '.join(types)}",
                f"see who has which ('compose {kind} {'info -v' if kind == 'topic' else 'type'}"
                f" {name}') and rename one of them",
            )


def unbuilt_types(used: Iterable[tuple[str, str, tuple[str, ...]]]) -> Iterator[Finding]:
    """Yield each type of (kind, name, types) that is not built for this Python."""
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
                f"{type_name} ({use}) is not built here: this computer cannot take part in it",
                f"install or build package '{type_name.split('/')[0]}' and source it",
            )


def _unfit_pair(topic: str, publisher: End, subscription: End) -> Iterator[Finding]:
    for found in incompatibilities(publisher.qos, subscription.qos):
        yield error(
            "qos",
            f"{topic}: {publisher.node} offers {found.policy} {found.offered},"
            f" {subscription.node} requests {found.requested}: no message goes between them",
            f"let {subscription.node} request {found.offered}, or {publisher.node} offer"
            f" {found.requested}",
        )
