"""A parameter that the class of a node does not declare."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.hosted_classes import hosted_classes
from composer.behavior_checks.node_classes import declared_names, is_declared
from composer.behavior_types.hosted import passes_node_on
from composer.diagnostics import Diagnostic, Rule, Severity, nearest, register

RULE = register(
    Rule(
        code="RC485",
        name="class-parameter",
        severity=Severity.WARNING,
        summary="A node sets a parameter that its class does not declare.",
        why="rclpy ignores it, so that the class uses its default.",
        bad="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    parameters: {rate: {type: double, default: 5.0}}
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
    """Compare the parameters of nodes with those of their classes."""
    for found in context.once(hosted_classes):
        source = found.source
        declared = declared_names(source) if source.complete and source.class_found else None
        for parameter in found.node.parameters if declared is not None else ():
            name = parameter.name.value
            if declared is None or is_declared(name, declared):
                continue
            close = nearest(name, declared)
            if close is None and passes_node_on(source):
                continue
            message = f"class '{found.hosted.reference.class_name}' declares no parameter '{name}'"
            hint = f"did you mean '{close}'?" if close is not None else None
            yield Diagnostic(RULE, message, parameter.name.span, hint=hint)
