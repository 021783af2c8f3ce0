"""The other processes of the stress of in-process delivery: plain rclpy, as anybody would write it.

usage: delivery_peer.py listen|talk TOPIC [WRITER]

``listen`` says ``heard`` at its first message and, when standard input closes, what it saw as JSON.
``talk`` publishes at 500 Hz as writer WRITER until it is ended, and says ``matched`` first.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time

import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Int64

from tests.ros.sequences import Sequences, number

DEPTH = 5000


def listen(node: Node, topic: str) -> None:
    seen = Sequences()
    ended = threading.Event()

    def wait_for_the_end() -> None:
        sys.stdin.read()
        ended.set()

    def take(message: Int64) -> None:
        if not seen.count:
            print("heard", flush=True)
        seen.take(message.data)

    node.create_subscription(Int64, topic, take, QoSProfile(depth=DEPTH))
    threading.Thread(target=wait_for_the_end, daemon=True).start()
    while not ended.is_set():
        rclpy.spin_once(node, timeout_sec=0.05)
    print(json.dumps({"count": seen.count, "wrong": seen.wrong}), flush=True)


def talk(node: Node, topic: str, writer: int) -> None:
    publisher = node.create_publisher(Int64, topic, QoSProfile(depth=DEPTH))
    while publisher.get_subscription_count() < 2:  # the listeners of the system
        time.sleep(0.01)
    print("matched", flush=True)
    for sequence in range(1_000_000):
        publisher.publish(Int64(data=number(writer, sequence)))
        time.sleep(0.002)


def main() -> None:
    rclpy.init()
    node = Node(f"peer_{os.getpid()}")
    if sys.argv[1] == "listen":
        listen(node, sys.argv[2])
    else:
        talk(node, sys.argv[2], int(sys.argv[3]))
    rclpy.shutdown()


if __name__ == "__main__":
    main()
