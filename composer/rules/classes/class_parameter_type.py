"""A parameter that the class of a node declares with another type."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.class_interfaces import parameter_types
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register
from composer.model import ParameterType

RULE = register(
    Rule(
        code="RC486",
        name="class-parameter-type",
        severity=Severity.ERROR,
        summary="A parameter of a node has another type than in its class.",
        why="rclpy refuses to declare it, with InvalidParameterTypeException.",
        bad="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    parameters: {rate_hz: {type: integer, default: 5}}
# file: robot_nodes.py
from rclpy.node import Node


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.declare_parameter("rate_hz", 10.0)
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    parameters: {rate_hz: {type: double, default: 5.0}}
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
    """Compare the types of parameters with the defaults in the classes."""
    known = {item.value for item in ParameterType}
    for found in context.once(hosted_classes):
        types = parameter_types(found) if found.node.parameters else {}
        for parameter in found.node.parameters:
            declared = types.get(parameter.name.value)
            given = parameter.type.value
            if declared is None or given not in known or declared.value == given:
                continue
            name = found.hosted.reference.class_name
            message = (
                f"class '{name}' declares parameter '{parameter.name.value}' as {declared.value},"
                f" not {given}"
            )
            where = Label(declared.span, "declared here")
            yield Diagnostic(RULE, message, parameter.type.span, (where,))
