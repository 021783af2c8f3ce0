"""Topics and services: nodes that disturb each other, and calls that cannot succeed."""

from __future__ import annotations

from collections.abc import Container, Iterator

from composer.base.diagnostics import Diagnostic, Label, error, info, warning
from composer.base.graphs import cycles
from composer.base.source import Span
from composer.model import (
    Channel,
    ChannelKind,
    Event,
    ImplementationKind,
    Node,
    Port,
    PortKind,
    PortOfNode,
    PrimaryState,
)
from composer.model.dependencies import dependency_cycles, in_dependency_order
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.formatting import number, port_name
from composer.rules.analysis.subjects import NAMESPACES, earlier_errors, port_subject, wiring
from composer.rules.connections import diagnostic_location, name_location
from composer.rules.lifecycle import START_ORDER

TOPIC_LOOP = warning("RC326", "topic-loop")
COMPETING_COMMANDS = warning("RC328", "competing-commands")

#: For each topic, the topics to which its messages are republished, with the subscription.
_Steps = dict[str, dict[str, PortOfNode]]
_VELOCITY_COMMANDS = frozenset(
    {
        "ackermann_msgs/msg/AckermannDrive",
        "ackermann_msgs/msg/AckermannDriveStamped",
        "geometry_msgs/msg/Twist",
        "geometry_msgs/msg/TwistStamped",
    }
)
DUPLICATE_SERVER = error("RC321", "duplicate-server")
UNSUITED_PATTERN = info("RC331", "unsuited-pattern")
_LONGEST_POLL_S = 1.0


def check_topic_loop(context: Context) -> Iterator[Diagnostic]:
    """Follow messages from topic to topic; report a cycle of each group of topics."""
    steps = _steps(context)
    graph = {topic: [name for name in targets if name in steps] for topic, targets in steps.items()}
    for names in cycles(graph):
        pairs = zip(names, (*names[1:], names[0]), strict=True)
        yield _topic_loop(names, [steps[topic][target] for topic, target in pairs])


def _steps(context: Context) -> _Steps:
    steps: _Steps = {}
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.SUBSCRIPTION):
            for target in _republished(node, port):
                if not is_unresolved(port.full_name) and not is_unresolved(target):
                    steps.setdefault(port.full_name, {})[target] = PortOfNode(node, port)
    return steps


def _republished(node: Node, port: Port) -> Iterator[str]:
    reaction = port.reaction(Event.MESSAGE)
    if reaction is None or reaction.when is not None:
        return
    for send in reaction.publish:
        target = node.port(send.port.value)
        if target is not None and target.kind is PortKind.PUBLISHER:
            yield target.full_name


def _topic_loop(names: tuple[str, ...], endpoints: list[PortOfNode]) -> Diagnostic:
    path = " -> ".join((*names, names[0]))
    first, *others = [(endpoint, diagnostic_location(endpoint)[0]) for endpoint in endpoints]
    return Diagnostic(
        TOPIC_LOOP,
        f"messages circulate forever: {path}",
        first[1],
        tuple(
            Label(place, f"'{port_name(endpoint)}' republishes them") for endpoint, place in others
        ),
        "publish from a timer, or add a 'when' condition that breaks the cycle",
    )


def check_own_publisher(context: Context) -> Iterator[Diagnostic]:
    """Look for topics that exactly one node both publishes and subscribes to."""
    for channel in context.channels:
        if channel.kind is not ChannelKind.TOPIC or not (channel.sources and channel.sinks):
            continue
        publishers = {end.node.full_name: end for end in channel.sources}
        both = [end for end in channel.sinks if end.node.full_name in publishers]
        names = {end.node.full_name for end in both}
        is_shared = all(
            any(end.node.full_name not in names for end in ends)
            for ends in (channel.sources, channel.sinks)
        )
        ports = {(end.node.full_name, end.port.name.value) for end in channel.sources}
        sending = [end for end in both if _sends_back(end, ports)]
        if len(names) != 1 or (is_shared and not sending):
            continue  # nodes exchange messages
        if not any(_is_unconditional(end) for end in sending):  # topic-loop reports these
            sink, source = both[0], publishers[both[0].node.full_name]
            place, labels = name_location(sink)
            published = Label(source.port.name.span, f"'{port_name(source)}' publishes them")
            yield Diagnostic(
                TOPIC_LOOP,
                f"node '{sink.node.name}' receives its own messages on '{channel.name}'",
                place,
                (*labels, published),
                "give one of the two ports another topic",
                relies_on=(*wiring(sink.node, sink.port), *wiring(source.node, source.port)),
            )


def _sends_back(end: PortOfNode, ports: Container[tuple[str, str]]) -> bool:
    """Return whether the reaction of a subscription publishes to its own topic.

    ``ports`` are the publishers of the topic: their nodes and their names.
    """
    reaction = end.port.reaction(Event.MESSAGE)
    sent = () if reaction is None else reaction.publish
    return any((end.node.full_name, send.port.value) in ports for send in sent)


def _is_unconditional(end: PortOfNode) -> bool:
    reaction = end.port.reaction(Event.MESSAGE)
    return reaction is not None and reaction.when is None


def check_competing_commands(context: Context) -> Iterator[Diagnostic]:
    """Count the nodes that publish velocity commands on each topic and start active."""
    system = context.system
    for channel in context.channels:
        if channel.kind is not ChannelKind.TOPIC:
            continue
        found: dict[str, PortOfNode] = {}
        for end in channel.sources:
            start = end.node.autostart.value if end.node.autostart else system.autostart
            if end.port.interface.value in _VELOCITY_COMMANDS and start is PrimaryState.ACTIVE:
                found.setdefault(end.node.full_name, end)
        first = next(iter(found.values()), None)
        for other in found.values():
            if first is None or other is first:
                continue
            yield Diagnostic(
                COMPETING_COMMANDS,
                f"'{port_name(other)}' and '{port_name(first)}' both command '{channel.name}'",
                other.port.name.span,
                (Label(first.port.name.span, "the other publisher"),),
                "use one topic for each, and a node that selects one of them",
                relies_on=(*wiring(first.node, first.port), *wiring(other.node, other.port)),
            )


def check_duplicate_server(context: Context) -> Iterator[Diagnostic]:
    """Count the servers of every service and action."""
    for channel in context.channels:
        if channel.kind is ChannelKind.TOPIC or len(channel.sources) < 2:
            continue
        first = channel.sources[0]
        for other in channel.sources[1:]:
            yield Diagnostic(
                DUPLICATE_SERVER,
                f"{channel.kind} '{channel.name}' is provided by both '{port_name(other)}' "
                f"and '{port_name(first)}'",
                _named_at(other),
                (Label(_named_at(first), "the other server"),),
                _other_name_hint(channel, other),
                relies_on=(
                    *NAMESPACES,
                    port_subject(first.node, first.port),
                    port_subject(other.node, other.port),
                    *wiring(first.node, first.port),
                    *wiring(other.node, other.port),
                ),
            )


def _named_at(server: PortOfNode) -> Span:
    """Return where a server gets its name: in a connection, or in its declaration."""
    return server.port.connected_at or server.port.name.span


def _other_name_hint(channel: Channel, other: PortOfNode) -> str:
    """Suggest a name below the node, unless the server has that name already."""
    node, port = other.node, other.port
    if f"{node.full_name}/{port.name}" == channel.name:
        return "rename one of them"
    return f"rename one of them, for example to '~/{port.name}'"


def check_client_before_server(context: Context) -> Iterator[Diagnostic]:
    """Compare the bring-up order with the services and actions."""
    system = context.system
    called = [
        channel
        for channel in context.channels
        if channel.kind is not ChannelKind.TOPIC and len(channel.sources) == 1
    ]
    if not called or dependency_cycles(system) or not system.implied_dependencies:
        return
    order = in_dependency_order(system)
    rank = {name: place for place, name in enumerate(order)}
    for channel in called:
        server = channel.sources[0]
        for client in channel.sinks:
            if rank[client.node.name.value] < rank[server.node.name.value]:
                yield _started_too_early(channel, client, server)


def _started_too_early(channel: Channel, client: PortOfNode, server: PortOfNode) -> Diagnostic:
    cause = next(iter(server.node.depends_on), None)
    place = cause.node.span if cause is not None else server.port.name.span
    return Diagnostic(
        START_ORDER,
        f"'{port_name(client)}' starts before '{port_name(server)}', "
        f"the server of '{channel.name}'",
        client.port.name.span,
        (Label(place, f"'{server.node.name}' starts later"),),
        f"make '{client.node.name}' depend on '{server.node.name}'",
    )


def check_polled_service(context: Context) -> Iterator[Diagnostic]:
    """Check the calls that timers make unconditionally."""
    for node in context.system.nodes:
        for timer in node.timers:
            period_s = node.period_s(timer)
            if timer.reaction is None or timer.reaction.when is not None or period_s is None:
                continue
            for send in timer.reaction.call:
                port = node.port(send.port.value)
                if port is None or port.kind is not PortKind.CLIENT or period_s >= _LONGEST_POLL_S:
                    continue
                yield Diagnostic(
                    UNSUITED_PATTERN,
                    f"timer '{timer.name}' calls service '{port.full_name}' "
                    f"{number(1 / period_s)} times a second",
                    send.port.span,
                    (Label(timer.period.span, "the timer's period"),),
                    "publish the data on a topic instead",
                )


def check_action_as_service(context: Context) -> Iterator[Diagnostic]:
    """Check the action servers that are declared entirely in YAML."""
    affected = context.once(earlier_errors).nodes  # feedback may be misspelled
    for node in context.system.nodes:
        if node.implementation is not ImplementationKind.DECLARATIVE:
            continue
        if node.name.value in affected:
            continue
        for port in node.ports_of(PortKind.ACTION_SERVER):
            if port.result is not None and port.feedback is None:
                yield Diagnostic(
                    UNSUITED_PATTERN,
                    f"action server '{port.name}' returns its result immediately, like a service",
                    port.name.span,
                    hint="use a service, or add feedback",
                )
