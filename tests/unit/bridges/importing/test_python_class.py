"""Node classes, described from their source."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from composer.bridges.importing.python_class import ClassNotFound, describe_class
from composer.bridges.importing.writing import write_node_type
from composer.model import PortKind
from tests.unit.support.checking import load_project, write_files

DRIVER = """\
import sys
import message_filters
import std_msgs.msg
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSPresetProfiles, QoSProfile, ReliabilityPolicy
from rclpy.qos import qos_profile_sensor_data as SENSOR
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from std_msgs.msg import String
from std_srvs.srv import Trigger

sys.exit("the module must not be executed")
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Base(Node):
    def __init__(self):
        super().__init__("lidar")
        self.declare_parameter("frame", "laser", ParameterDescriptor(read_only=True))


class Lidar(Base):
    TOPIC = "scan"

    def __init__(self):
        super().__init__()
        rate = FloatingPointRange(from_value=0.0, to_value=50.0, step=0.0)
        self.declare_parameter(
            "rate", 10.0, ParameterDescriptor(floating_point_range=[FloatingPointRange(
                from_value=0.0, to_value=50.0)], description="Rate.")
        )
        self.declare_parameters("limits", [("x", -1), ("y", [1.0, 2.0])])
        self.pub = self.create_publisher(String, self.TOPIC, SENSOR)
        self.status = self.create_publisher(String, "~/status", LATCHED)
        qos = QoSProfile(
            depth=3, reliability=ReliabilityPolicy.BEST_EFFORT, deadline=Duration(seconds=0.5)
        )
        self.create_subscription(
            std_msgs.msg.String, topic="/cmd", callback=self.on, qos_profile=qos
        )
        self.create_subscription(String, "map", self.on, QoSPresetProfiles.SENSOR_DATA.value)
        message_filters.Subscriber(self, String, "depth", qos_profile=SENSOR)
        self.create_service(Trigger, "reset", self.on)
        self.create_client(Trigger, "stop")
        changed = QoSProfile(depth=3)
        changed.depth = 7
        self.create_publisher(String, "changed", changed)
        self.declare_parameters("", [("speed", Parameter.Type.DOUBLE)])
        least = QoSProfile(depth=0, lifespan=Duration())
        self.create_publisher(String, "least", least)
        for i in range(2):
            self.create_publisher(String, f"out{i}", 10)
        self.create_publisher(self.kind, "any", 10)

    def on(self, message):
        pass
"""


def test_the_source_shows_ports_and_parameters_and_what_it_does_not(tmp_path: Path) -> None:
    (tmp_path / "driver.py").write_text(DRIVER, encoding="utf-8")
    found, unknown = describe_class("driver:Lidar", tmp_path)
    text = write_node_type("lidar", found)
    written = [line for line in text.splitlines() if not line.strip().startswith("#")]
    assert (
        "\n".join(written)
        == """\
node: lidar
class: "driver:Lidar"
parameters:
  rate: {type: double, default: 10.0, minimum: 0.0, maximum: 50.0, description: Rate.}
  limits.x: {type: integer, default: -1}
  limits.y: {type: double_array, default: [1.0, 2.0]}
  speed: {type: double}
  frame: {type: string, default: laser, read_only: true}
publishers:
  scan: {type: std_msgs/msg/String, qos: sensor_data}
  status: {type: std_msgs/msg/String, topic: "~/status", qos: state}
  changed: {type: std_msgs/msg/String}
  least: {type: std_msgs/msg/String, qos: {depth: 1}}
subscriptions:
  cmd:
    type: std_msgs/msg/String
    topic: /cmd
    qos: {depth: 3, reliability: best_effort, deadline_ms: 500.0}
  map: {type: std_msgs/msg/String, qos: sensor_data}
  depth: {type: std_msgs/msg/String, qos: sensor_data}
services:
  reset: {type: std_srvs/srv/Trigger}
clients:
  stop: {type: std_srvs/srv/Trigger}"""
    )
    assert [item.partition(": ")[2] for item in unknown] == [
        "the QoS of publisher changed, because of changed",
        "a publisher, because of f'out{i}'",
        "a publisher, because of self.kind",
    ]
    assert "  # driver.py:35" in text.splitlines()
    assert "driver" not in sys.modules


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("driver:Lidr", "module 'driver' has no class 'Lidr'", "did you mean 'Lidar'?"),
        ("drver:Lidar", "no Python module named 'drver'", "did you mean 'driver'?"),
        ("zzz.zzz:Lidar", "no Python module named 'zzz.zzz'", "this folder"),
        ("driver", "'driver' does not name a class", "demo_nodes_py"),
        ("broken:A", "module 'broken' is not Python", ""),
        ("plain:A", "class 'A' is not derived from rclpy's Node", "compose new node"),
    ],
)
def test_other_things_are_explained(text: str, message: str, hint: str, tmp_path: Path) -> None:
    broken, plain = "class A(\n", "class A:\n    pass\n"
    write_files(tmp_path, {"driver.py": DRIVER, "broken.py": broken, "plain.py": plain})
    with pytest.raises(ClassNotFound, match=message) as raised:
        describe_class(text, tmp_path)
    assert hint in str(raised.value.hint)


def test_a_source_folder_with_the_name_of_rclpy_is_read(tmp_path: Path) -> None:
    write_files(tmp_path / "rclpy", {"driver.py": DRIVER})
    node, _ = describe_class("driver:Lidar", tmp_path / "rclpy")
    assert node.ports


BRANCHES = """\
import os
from rclpy.node import Node
from std_msgs.msg import Int32, String


class Guard(Node):
    def __init__(self, area, *, alarm, limit=1):
        super().__init__("guard")
        self.create_subscription(String, "words", print, 10)
        self.create_publisher(String, "words", 10)
        if os.environ.get("DEBUG"):
            self.create_publisher(String, "debug", 10)
            self.declare_parameter("depth", 1)
        elif self.name:
            self.create_publisher(String, "both", 10)
        else:
            self.create_publisher(Int32, "both", 10)
        try:
            self.create_publisher(String, "tried", 10)
        except (ValueError, KeyError):
            self.create_publisher(String, "fallback", 10)
        match self.name:
            case "a":
                self.create_publisher(String, "matched", 10)
        for name in ():
            self.create_publisher(String, "looped", 10)
        self.ready() and self.create_publisher(String, "ready", 10)
        pub = self.create_publisher(String, "x", 10) if self.name else None
        if not alarm or limit:
            self.create_publisher(String, "either", 10)
        if alarm or limit:
            self.create_publisher(String, "either", 10)
        if not (alarm and limit):
            self.create_publisher(String, "always", 10)
        if alarm and limit:
            self.create_publisher(String, "always", 10)
        (alarm or limit) or self.create_publisher(String, "neither", 10)
        if not self.name:
            return
        self.create_publisher(String, "last", 10)
"""


def test_what_is_open_is_listed_and_the_file_is_valid(tmp_path: Path) -> None:
    (tmp_path / "guard.py").write_text(BRANCHES)
    node, unknown = describe_class("guard:Guard", tmp_path)
    assert unknown == (
        "guard.py:17: which type the publisher both has: also std_msgs/msg/Int32",
        "guard.py:12: whether there is the publisher debug: only if os.environ.get('DEBUG')",
        "guard.py:13: whether there is the parameter depth: only if os.environ.get('DEBUG')",
        "guard.py:21: whether there is the publisher fallback: "
        "only if (ValueError, KeyError) is raised",
        "guard.py:24: whether there is the publisher matched: only if self.name matches 'a'",
        "guard.py:27: whether there is the publisher ready: only if self.ready()",
        "guard.py:28: whether there is the publisher x: only if self.name",
        "guard.py:30: whether there is the publisher either: only if not alarm or limit",
        "guard.py:37: whether there is the publisher neither: only if not (alarm or limit)",
        "guard.py:40: whether there is the publisher last: only if self.name",
        "guard.py:7: the value of argument area of the constructor: 'arguments' sets it",
        "guard.py:7: the value of argument alarm of the constructor: 'arguments' sets it",
    )
    result = load_project(tmp_path, {"guard.yaml": write_node_type("guard", node)})
    assert [item for item in result.diagnostics if item.severity is Severity.ERROR] == []
    (guard,) = result.system.nodes
    words = {port.name.value: port.kind for port in guard.ports if port.full_name == "/words"}
    assert words == {"words": PortKind.PUBLISHER, "words_2": PortKind.SUBSCRIPTION}
