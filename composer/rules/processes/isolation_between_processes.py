"""The isolation of a connection between processes."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.diagnostics import Diagnostic, info
from composer.model import Channel

RULE = info(
    code="RC541",
    name="isolation-between-processes",
    summary="A connection whose ports are in different processes has 'isolation'.",
    why=(
        "Between processes, messages go through DDS: each receiver has an object of its own, "
        "and none is shared. The setting has no effect. With 'share', the nodes were probably "
        "meant to be in one process, for example to exchange images without copies."
    ),
    bad="""\
system: robot
processes: {vision: {nodes: [camera]}}
nodes:
  camera:
    publishers: {image: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 100, publish: {image: {data: picture}}}}
  detector:
    subscriptions: {image: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
connections:
  - {topic: /image, from: camera.image, to: detector.image, isolation: share}
""",
    good="""\
system: robot
processes: {vision: {nodes: [camera, detector]}}
nodes:
  camera:
    publishers: {image: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 100, publish: {image: {data: picture}}}}
  detector:
    subscriptions: {image: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
connections:
  - {topic: /image, from: camera.image, to: detector.image, isolation: share}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the connections with 'isolation', with all ports of their topics."""
    channel_of = {
        (end.node.name.value, end.port.name.value): channel
        for channel in context.channels
        for end in channel.ends
    }
    for connection in context.system.connections:
        if connection.isolation is None:
            continue
        ports = connection.ends
        found = [channel_of.get((end.node, end.port)) for end in ports]
        known = [channel for channel in found if channel is not None]
        if len(known) < len(found) or not known or any(map(_has_pair_in_process, known)):
            continue
        if not all(channel.sources and channel.sinks for channel in known):
            continue
        yield Diagnostic(
            RULE,
            f"'isolation' of '{connection.name}' has no effect: no two of its nodes are in the "
            "same process",
            connection.isolation.span,
            hint="assign them to one process, or remove 'isolation'",
        )


def _has_pair_in_process(channel: Channel) -> bool:
    """Return whether messages of the channel may stay in a process."""
    return any(
        source.node.implementation.in_process
        and sink.node.implementation.in_process
        and source.node.process == sink.node.process
        for source in channel.sources
        for sink in channel.sinks
    )
