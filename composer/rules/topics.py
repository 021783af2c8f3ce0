"""Nodes that disturb each other, or themselves, on a topic."""

from __future__ import annotations

from collections.abc import Container, Iterator

from composer.base.diagnostics import Diagnostic, Label, warning
from composer.model import ChannelKind, Event, Port, PortKind, PortOfNode, PrimaryState
from composer.rules.analysis.context import Context, is_unresolved
from composer.rules.analysis.formatting import port_name
from composer.rules.analysis.subjects import wiring
from composer.rules.connections import diagnostic_location, name_location

TOPIC_LOOP = warning("RC326", "topic-loop")
COMPETING_COMMANDS = warning("RC328", "competing-commands")

#: For each topic, the topics to which its messages are republished, with the subscription.
_Steps = dict[str, dict[str, PortOfNode]]


def check_topic_loop(context: Context) -> Iterator[Diagnostic]:
    """Follow messages from topic to topic; report every cycle once."""
    steps = _steps(context)
    done: set[str] = set()
    for start in steps:
        cycle = _first_cycle(steps, start, done)
        if cycle:
            yield _topic_loop(cycle)


def _steps(context: Context) -> _Steps:
    steps: _Steps = {}
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.SUBSCRIPTION):
            for target in _republished(node.ports_of(PortKind.PUBLISHER), port):
                if not is_unresolved(port.full_name) and not is_unresolved(target):
                    steps.setdefault(port.full_name, {})[target] = PortOfNode(node, port)
    return steps


def _republished(publishers: tuple[Port, ...], port: Port) -> Iterator[str]:
    reaction = port.reaction(Event.MESSAGE)
    if reaction is None or reaction.when is not None:
        return
    names = {send.port.value for send in reaction.publish}
    yield from (item.full_name for item in publishers if item.name.value in names)


def _first_cycle(steps: _Steps, start: str, done: set[str]) -> list[tuple[str, PortOfNode]]:
    """Return the first cycle that can be reached from ``start`` through topics not ``done``.

    Each item is a topic and the subscription that republishes to it.
    """
    path: list[str] = []
    steps_taken: list[tuple[str, PortOfNode]] = []
    rest = {start: iter(steps.get(start, {}).items())}
    if start not in done:
        path.append(start)
    while path:
        target, endpoint = next(rest[path[-1]], (None, None))
        if target is None or endpoint is None:
            done.add(path.pop())
            steps_taken = steps_taken[: max(len(path) - 1, 0)]
        elif target in path:
            done.update(path)
            return [*steps_taken[path.index(target) :], (target, endpoint)]
        elif target not in done:
            steps_taken.append((target, endpoint))
            path.append(target)
            rest[target] = iter(steps.get(target, {}).items())
    return []


def _topic_loop(cycle: list[tuple[str, PortOfNode]]) -> Diagnostic:
    names = [topic for topic, _ in cycle]
    path = " -> ".join((names[-1], *names))
    first, *others = [(endpoint, diagnostic_location(endpoint)[0]) for _, endpoint in cycle]
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
        if channel.kind is not ChannelKind.TOPIC:
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


_VELOCITY_COMMANDS = frozenset(
    {
        "ackermann_msgs/msg/AckermannDrive",
        "ackermann_msgs/msg/AckermannDriveStamped",
        "geometry_msgs/msg/Twist",
        "geometry_msgs/msg/TwistStamped",
    }
)


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
