"""A class that spins its node in its constructor."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC464",
        name="class-spins",
        severity=Severity.ERROR,
        summary="The constructor of a class spins its node.",
        why=(
            "rclpy.spin returns when the process ends, so the node would never be configured. "
            "The composer calls the callbacks of the class."
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
        rclpy.spin(self)
""",
        good="""\
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


def main():
    rclpy.init()
    rclpy.spin(Talker())
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Check the calls of every constructor."""
    for found in context.once(hosted_classes):
        constructor = found.constructor
        for call in constructor.calls if constructor is not None else ():
            if call.name == "rclpy.spin" and not call.deferred:
                yield found.diagnostic(
                    RULE,
                    f"the constructor of '{found.source.reference.class_name}' calls rclpy.spin,"
                    " which never returns",
                    call.span,
                    "spin in the main function of the program, or run it as an 'executable'",
                )
