"""A port with another type than in the class of its node."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.class_interfaces import created_ports
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Label, Rule, Severity, register

RULE = register(
    Rule(
        code="RC487",
        name="class-port-type",
        severity=Severity.ERROR,
        summary="A port of a node has another type than in its class.",
        why="The class decides; endpoints of different types on one name never communicate.",
        bad="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    publishers: {range: {type: std_msgs/msg/Float32, qos: command, external: true}}
# file: robot_nodes.py
from rclpy.node import Node
from std_msgs.msg import Float64


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.range = self.create_publisher(Float64, "range", 10)
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    publishers: {range: {type: std_msgs/msg/Float64, qos: command, external: true}}
# file: robot_nodes.py
from rclpy.node import Node
from std_msgs.msg import Float64


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.range = self.create_publisher(Float64, "range", 10)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Compare the types of ports with those that the classes create."""
    for found in context.once(hosted_classes):
        created = list(created_ports(found)) if found.node.ports else []
        for port in found.node.ports:
            same = [
                item
                for item in created
                if item.kind is port.kind and item.name == port.ros_name.value
            ]
            types = {item.interface.value for item in same}
            if not types or port.interface.value in types:
                continue
            name, other = found.hosted.reference.class_name, same[0].interface
            message = (
                f"class '{name}' creates {port.kind.value} '{port.ros_name.value}' with type"
                f" {other.value}, not {port.interface.value}"
            )
            where = Label(other.span, "created here")
            yield Diagnostic(RULE, message, port.interface.span, (where,))
