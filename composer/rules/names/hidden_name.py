"""A name that ROS tools hide by default."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, info
from composer.names import is_hidden, topic_name_problem
from composer.source import Located

RULE = info(
    code="RC232",
    name="hidden-name",
    summary="A part of a name starts with an underscore, so ROS tools hide it.",
    why=(
        "ROS reserves a leading underscore for hidden names. 'ros2 topic list', rqt and "
        "rosbag omit them by default, so they are easily overlooked."
    ),
    bad="""\
system: hidden
nodes:
  talker:
    publishers: {_status: {type: std_msgs/msg/String, qos: state, external: true}}
""",
    good="""\
system: hidden
nodes:
  talker:
    publishers: {status: {type: std_msgs/msg/String, qos: state, external: true}}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the names of nodes, ports and connections."""
    for word, name in _names(context):
        if (
            is_hidden(name.value)
            and not is_unresolved(name.value)
            and not topic_name_problem(name.value)
        ):
            yield Diagnostic(
                RULE,
                f"{word} '{name}' is hidden from ROS tools by its leading underscore",
                name.span,
            )


def _names(context: Context) -> Iterator[tuple[str, Located[str]]]:
    for node in context.system.nodes:
        yield "node", node.ros_name
        for port in node.ports:
            yield port.kind.channel.value, port.ros_name
    for connection in context.system.connections:
        yield connection.kind.value, connection.name
