"""A topic, service or action name that is not valid in ROS."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context, is_unresolved
from composer.diagnostics import Diagnostic, error
from composer.names import remapped_name, topic_name_problem
from composer.source import Located

RULE = error(
    code="RC223",
    name="invalid-ros-name",
    summary="The name of a topic, service or action is not valid in ROS.",
    why=(
        "The parts of a name consist of letters, digits and underscores, do not start with a "
        "digit, and are separated by single slashes; '~' is allowed only at the start "
        "(rcl_validate_topic_name). rclpy refuses any other name."
    ),
    bad="""\
system: names
nodes:
  talker:
    publishers:
      chatter:
        {type: std_msgs/msg/String, qos: command, topic: /news//today, external: true}
""",
    good="""\
system: names
nodes:
  talker:
    publishers:
      chatter: {type: std_msgs/msg/String, qos: command, topic: /news/today, external: true}
""",
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the names of ports, of connections, and in remappings."""
    for kind, name in _names(context):
        problem = topic_name_problem(name.value)
        if problem is not None and not is_unresolved(name.value):
            yield Diagnostic(RULE, f"{kind} name '{name}' {problem}", name.span)


def _names(context: Context) -> Iterator[tuple[str, Located[str]]]:
    for node in context.system.nodes:
        for port in node.ports:
            yield port.kind.channel.value, port.ros_name
        is_rule_of_rcl = not node.implementation.declares_everything
        for remapping in node.remappings:
            yield "remapped", remapping.source.map(remapped_name if is_rule_of_rcl else str)
            yield "remapped", remapping.target
    for connection in context.system.connections:
        if not connection.name.value.startswith("~"):
            yield connection.kind.value, connection.name
