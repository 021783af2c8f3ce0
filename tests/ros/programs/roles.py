"""Small programs in plain rclpy.

usage: roles.py ROLE [ARGUMENT...]
"""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String

from tests.ros.programs.spinning import spin


def echo(node: Node, topic: str) -> None:
    """Subscribe as ``ros2 topic echo`` does: with the QoS profile of the publisher.

    Prints ``ready``, then the number of messages that were lost before the third one arrived.
    """
    while not node.count_publishers(topic):
        time.sleep(0.01)
    print("ready", flush=True)
    lost: list[int] = []
    received: list[String] = []
    node.create_subscription(
        String,
        topic,
        received.append,
        QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL),
        event_callbacks=SubscriptionEventCallbacks(
            message_lost=lambda status: lost.append(status.total_count_change)
        ),
    )
    while len(received) < 3:
        rclpy.spin_once(node)
    print(sum(lost), flush=True)


def intruder(node: Node) -> None:
    """Put a String on the pipeline's odometry topic, undeclared. Prints ``ready``."""
    publisher = node.create_publisher(String, "/sensor_data", 10)
    node.create_timer(0.1, lambda: publisher.publish(String(data="x")))
    spin(node)


def numbering(node: Node) -> None:
    """Listen to /numbers for five messages, print them with the middleware's numbers, and leave."""
    received: list[tuple[int, int]] = []

    def on_number(message: Int64, info: dict[str, Any]) -> None:
        received.append((message.data, info["publication_sequence_number"]))

    node.create_subscription(Int64, "/numbers", on_number, 100)
    while len(received) < 5:
        rclpy.spin_once(node)
    print(json.dumps(received), flush=True)
    node.destroy_node()
    rclpy.shutdown()


def observer(node: Node, topic: str, *expected: str) -> None:
    """Wait for other nodes, and count the messages of a topic (String).

    Prints ``ready`` once it knows all expected nodes, and for each line of stdin the number of
    messages so far and the names of the nodes that it knows.
    """
    received: list[String] = []
    node.create_subscription(String, topic, received.append, 10)

    def answer() -> None:
        for _ in sys.stdin:
            print(len(received), *sorted(node.get_node_names()), flush=True)
        rclpy.try_shutdown()

    threading.Thread(target=answer, daemon=True).start()
    is_ready = False
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.05)
        if not is_ready and set(expected) <= set(node.get_node_names()):
            is_ready = True
            print("ready", flush=True)


ROLES = {role.__name__: role for role in (echo, intruder, numbering, observer)}

if __name__ == "__main__":
    rclpy.init()
    name = sys.argv[1]
    ROLES[name](Node(name), *sys.argv[2:])
