"""``self.node``: what libraries create for a behavior follows the lifecycle of its node."""

from __future__ import annotations

from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String

from tests.ros.support.in_process import Peer, running, wait_until

SYSTEM = """
system: library
nodes:
  user:
    behavior: user:User
    lifecycle: {autostart: inactive}
    parameters: {gain: {type: double, default: 1.0}}
    publishers: {numbers: {type: std_msgs/msg/Int64, qos: command, external: true}}
  own: {behavior: "user:Own"}
"""
#: Like the listeners and broadcasters of tf2_ros, and the subscribers of message_filters.
USER = """
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String

class Library:
    def __init__(self, node):
        assert isinstance(node, Node)
        self.node = node
        self.received = []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.declare_parameter("library.rate", 100.0)
        self.frames = node.create_publisher(String, "frames", latched)
        self.frames.publish(String(data="base"))
        self.numbers = node.create_publisher(Int64, "numbers", 10)
        node.create_subscription(Int64, "commands", self.on_command, 10)
        self.count = 0
        node.create_timer(1.0 / node.get_parameter("library.rate").value, self.on_tick)

    def on_command(self, message):
        self.received.append(message.data)

    def on_tick(self):
        self.count += 1
        self.numbers.publish(Int64(data=self.count))

class User:
    def on_configure(self):
        self.helper = Library(self.node)

class Own:
    def __init__(self):
        self.node = "mine"  # an attribute of that name is kept

    def on_activate(self):
        self.log.info(self.node)
"""


def test_what_a_library_creates_follows_the_lifecycle(tmp_path: Path, peer: Peer) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with running(SYSTEM, tmp_path, user=USER) as system:
        system.wait_for_log("mine")
        undeclared = [line for line in system.log() if "is not declared" in line]
        assert undeclared == [
            "publisher on /frames is not declared: it uses DDS (std_msgs/msg/String)",
            "subscription on /commands is not declared: it uses DDS (std_msgs/msg/Int64)",
        ]
        numbers, frames = peer.listen(Int64, "/numbers"), peer.listen(String, "/frames", latched)
        commands = peer.publisher(Int64, "/commands")
        library = system.behavior("user").helper
        commands.publish(Int64(data=1))
        wait_until(lambda: system.node("user").statistics.dropped == 1)
        assert (numbers, frames, library.count, library.received) == ([], [], 0, [])
        system.change("user", "activate")
        wait_until(lambda: numbers and frames)
        commands.publish(Int64(data=2))
        wait_until(lambda: library.received == [2])
        assert peer.set_parameter("/user", "library.rate", 50.0) == ""
        assert peer.set_parameter("/user", "gain", 2.0) == ""
        system.change("user", "deactivate")
        count = library.count
        system.change("user", "cleanup")
        assert library.count == count
        wait_until(lambda: peer.node.count_publishers("/frames") == 0)
        system.change("user", "configure", "activate")
        again = system.behavior("user").helper
        wait_until(lambda: again.count >= 1)
        assert again.node.get_parameter("library.rate").value == 50.0
        assert again.node.get_parameter("gain").value == 2.0
        counted = system.summary("/user")
    assert counted.errors == 0
