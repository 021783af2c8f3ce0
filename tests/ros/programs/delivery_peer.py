"""The other processes of the stress of in-process delivery: in plain rclpy.

usage: delivery_peer.py listen|talk RELIABILITY DEPTH WRITER TOPIC...

``listen`` prints periodically what it has received since, as JSON, by topic. ``talk`` publishes at
500 Hz as writer WRITER, each message on every topic. Both shut down when standard input closes.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int64

from tests.ros.support.sequences import number

PERIOD_S = 0.002
PRINT_PERIOD_S = 0.1


def listen(node: Node, topics: list[str], profile: QoSProfile, ended: threading.Event) -> None:
    received: dict[str, list[int]] = {topic: [] for topic in topics}
    for topic, numbers in received.items():
        node.create_subscription(
            Int64, topic, lambda message, numbers=numbers: numbers.append(message.data), profile
        )
    while not ended.is_set():
        printed_s = time.monotonic()
        while time.monotonic() < printed_s + PRINT_PERIOD_S:
            rclpy.spin_once(node, timeout_sec=PRINT_PERIOD_S)
        print(json.dumps(received), flush=True)
        for numbers in received.values():
            numbers.clear()


def talk(
    node: Node, topics: list[str], profile: QoSProfile, writer: int, ended: threading.Event
) -> None:
    publishers = [node.create_publisher(Int64, topic, profile) for topic in topics]
    sequence = 0
    while not ended.wait(PERIOD_S):
        for publisher in publishers:
            publisher.publish(Int64(data=number(writer, sequence)))
        sequence += 1


def main() -> None:
    what, reliability, depth, writer, *topics = sys.argv[1:]
    profile = QoSProfile(depth=int(depth), reliability=ReliabilityPolicy[reliability])
    ended = threading.Event()

    def wait_for_the_end() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=wait_for_the_end, daemon=True).start()
    rclpy.init()
    node = Node(f"peer_{os.getpid()}")
    if what == "listen":
        listen(node, topics, profile, ended)
    else:
        talk(node, topics, profile, int(writer), ended)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
