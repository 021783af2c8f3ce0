"""A class that is not an rclpy node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC462",
        name="class-not-a-node",
        severity=Severity.ERROR,
        summary="A class is not derived from rclpy's Node or LifecycleNode.",
        why="Only these classes create ROS nodes. A class without ROS is a behavior.",
        bad="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker}
# file: robot_nodes.py
class Talker:
    def on_tick(self):
        pass
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the bases of classes whose bases are all known."""
    for found in context.once(hosted_classes):
        source = found.source
        if source.complete and source.class_span is not None and not found.is_node:
            yield found.diagnostic(
                RULE,
                f"class '{source.reference.class_name}' is not derived from rclpy's Node",
                source.class_span,
                "for a class without ROS, write 'behavior' instead of 'class'",
            )
