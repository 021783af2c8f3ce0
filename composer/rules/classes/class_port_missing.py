"""A port that the class of its node does not create."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.python.class_interfaces import all_created_ports
from composer.analysis.python.hosted_classes import hosted_classes
from composer.diagnostics import Diagnostic, Rule, Severity, nearest, register
from composer.model import PortKind

_KINDS = frozenset({PortKind.PUBLISHER, PortKind.SUBSCRIPTION, PortKind.SERVICE, PortKind.CLIENT})

RULE = register(
    Rule(
        code="RC499",
        name="class-port-missing",
        severity=Severity.WARNING,
        summary="A node declares a port that its class creates under another name.",
        why=(
            "Nothing is sent or received on the port, although connections and other checks rely "
            "on it. The name is the one that the class uses; 'topic' or 'service' gives it."
        ),
        bad="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    publishers: {rang: {type: std_msgs/msg/Float32, qos: command, external: true}}
# file: robot_nodes.py
from rclpy.node import Node
from std_msgs.msg import Float32


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.range = self.create_publisher(Float32, "range", 10)
""",
        good="""\
# file: system.yaml
system: robot
nodes:
  lidar:
    class: robot_nodes:Lidar
    publishers: {range: {type: std_msgs/msg/Float32, qos: command, external: true}}
# file: robot_nodes.py
from rclpy.node import Node
from std_msgs.msg import Float32


class Lidar(Node):
    def __init__(self):
        super().__init__("lidar")
        self.range = self.create_publisher(Float32, "range", 10)
""",
    )
)


def check(context: Context) -> Iterator[Diagnostic]:
    """Report the declared ports that are not among those that the classes create."""
    for found in context.once(hosted_classes):
        ports = [port for port in found.node.ports if port.kind in _KINDS]
        created = all_created_ports(found) if ports else None
        for port in ports if created is not None else ():
            names = [name for kind, name in created or () if kind is port.kind]
            declared = {_last(item.ros_name.value) for item in ports if item.kind is port.kind}
            others = [name for name in names if _last(name) not in declared]
            # without another name, the class may be one that is not finished
            if _last(port.ros_name.value) in map(_last, names) or not others:
                continue
            class_name, name = found.hosted.reference.class_name, port.ros_name.value
            message = f"class '{class_name}' creates no {port.kind.value} '{name}'"
            close = nearest(name, others)
            listed = " and ".join(f"'{other}'" for other in others)
            hint = f"did you mean '{close}'?" if close is not None else f"it creates {listed}"
            yield Diagnostic(RULE, message, port.ros_name.span, (), hint)


def _last(name: str) -> str:
    return name.rpartition("/")[2]
