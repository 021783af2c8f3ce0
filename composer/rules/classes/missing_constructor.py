"""A class whose constructor does not call that of Node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC484",
        name="missing-constructor",
        severity=Severity.ERROR,
        summary="The constructor of a class does not call that of Node.",
        why="Without super().__init__(name), there is no node: every use of it raises an error.",
        bad="""\
# file: system.yaml
system: robot
nodes:
  lidar: {class: robot_nodes:Lidar}
# file: robot_nodes.py
from rclpy.node import Node


class Lidar(Node):
    def __init__(self):
        self.declare_parameter("rate_hz", 10.0)
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  lidar: {class: robot_nodes:Lidar}
# file: robot_nodes.py
from rclpy.node import Node


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.declare_parameter("rate_hz", 10.0)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Look for the call in the constructors of classes derived from Node."""
    yield from diagnostics_of(context, Kind.CONSTRUCTOR, RULE)
