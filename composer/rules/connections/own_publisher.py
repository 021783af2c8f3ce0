"""A node that receives its own messages."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.endpoints.unconnected import name_location
from composer.analysis.formatting import port_name
from composer.diagnostics import Diagnostic, Label, warning
from composer.model import Channel, ChannelKind, Event, PortOfNode

RULE = warning(
    code="RC327",
    name="own-publisher",
    summary="A node subscribes to a topic that it publishes itself.",
    why=(
        "The node receives each of its own messages, which is rarely meant: usually, one of "
        "the two topics is wrong. Nodes that exchange messages on one topic, such as alarms, "
        "are not reported."
    ),
    bad="""\
system: loops
nodes:
  robot:
    publishers: {report: {type: std_msgs/msg/String, qos: command, topic: reports}}
    subscriptions: {order: {type: std_msgs/msg/String, qos: command, topic: reports, log: ordered}}
    timers: {tick: {period_ms: 1000, publish: {report: {data: idle}}}}
""",
    good="""\
system: loops
nodes:
  robot:
    publishers: {report: {type: std_msgs/msg/String, qos: command, topic: reports}}
    subscriptions: {order: {type: std_msgs/msg/String, qos: command, topic: orders, log: ordered}}
    timers: {tick: {period_ms: 1000, publish: {report: {data: idle}}}}
  console:
    publishers: {order: {type: std_msgs/msg/String, qos: command, topic: orders}}
    subscriptions: {report: {type: std_msgs/msg/String, qos: command, topic: reports, log: idle}}
    timers: {tick: {period_ms: 1000, publish: {order: {data: go}}}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
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
        sending = [end for end in both if _sends_back(channel, end)]
        if len(names) != 1 or (is_shared and not sending):
            continue  # nodes exchange messages
        if not any(_is_unconditional(end) for end in sending):  # topic-loop reports these
            sink, source = both[0], publishers[both[0].node.full_name]
            place, labels = name_location(sink)
            published = Label(source.port.name.span, f"'{port_name(source)}' publishes them")
            yield Diagnostic(
                RULE,
                f"node '{sink.node.name}' receives its own messages on '{channel.name}'",
                place,
                (*labels, published),
                "give one of the two ports another topic",
            )


def _sends_back(channel: Channel, end: PortOfNode) -> bool:
    """Return whether the reaction of a subscription publishes to its own topic."""
    reaction = end.port.reaction(Event.MESSAGE)
    sent = {send.port.value for send in reaction.publish} if reaction is not None else set()
    return any(
        source.node is end.node and source.port.name.value in sent for source in channel.sources
    )


def _is_unconditional(end: PortOfNode) -> bool:
    reaction = end.port.reaction(Event.MESSAGE)
    return reaction is not None and reaction.when is None
