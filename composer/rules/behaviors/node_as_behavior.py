"""An rclpy node in place of a behavior."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behaviors import behaviors
from composer.analysis.python.hosted_classes import is_rclpy_node
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register

RULE = register(
    Rule(
        code="RC534",
        name="node-as-behavior",
        severity=Severity.ERROR,
        summary="A behavior is derived from rclpy's Node or LifecycleNode.",
        why=(
            "A behavior belongs to a node of the composer and has no ports of its own. A class "
            "that is a ROS node runs with 'class'."
        ),
        bad="""\
# file: system.yaml
system: robot
nodes:
  talker: {behavior: "robot_nodes:Talker"}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: "robot_nodes:Talker"}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the bases of every behavior."""
    for node, source in context.once(behaviors):
        if node.behavior is None or source.class_span is None or not is_rclpy_node(source):
            continue
        yield Diagnostic(
            RULE,
            f"'{source.reference.class_name}' is an rclpy node, not a behavior",
            node.behavior.text.span,
            (Label(source.class_span, "here"),),
            "write 'class' instead of 'behavior'",
        )
