"""A class that creates a second node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC465",
        name="class-second-node",
        severity=Severity.ERROR,
        summary="A class creates a second ROS node.",
        why=(
            "Nothing would spin the second node, and it would not follow the lifecycle. Every "
            "node of a system is declared."
        ),
        bad="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker}
# file: robot_nodes.py
import rclpy
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.helper = rclpy.create_node("helper")
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  talker: {class: robot_nodes:Talker}
  helper: {class: robot_nodes:Helper}
# file: robot_nodes.py
from rclpy.node import Node


class Talker(Node):
    def __init__(self):
        super().__init__("talker")


class Helper(Node):
    def __init__(self):
        super().__init__("helper")
""",
    )
)

_CREATORS = frozenset(
    {
        "rclpy.create_node",
        "rclpy.node.Node",
        "rclpy.lifecycle.LifecycleNode",
        "rclpy.lifecycle.Node",
    }
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the calls of all methods of every class."""
    for found in context.once(hosted_classes):
        for method in found.methods:
            for call in method.calls:
                if call.name in _CREATORS:
                    yield found.diagnostic(
                        RULE,
                        f"'{method.name}' of '{found.source.reference.class_name}' creates a second"
                        " node",
                        call.span,
                        "declare it as a node of the system, or run the program as an 'executable'",
                    )
