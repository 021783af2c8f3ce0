"""A class that reads a parameter that it does not declare."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.behavior_code import diagnostics_of
from composer.behavior_checks import Kind
from composer.diagnostics import Diagnostic, Rule, Severity, register

RULE = register(
    Rule(
        code="RC483",
        name="undeclared-parameter",
        severity=Severity.ERROR,
        summary="A class reads a parameter that it does not declare.",
        why="rclpy raises ParameterNotDeclaredException, in the constructor or in a callback.",
        bad="""\
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
        self.rate = self.get_parameter("rate").value
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
        self.rate = self.get_parameter("rate_hz").value
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the names that are read with those that are declared."""
    yield from diagnostics_of(context, Kind.PARAMETER, RULE)
