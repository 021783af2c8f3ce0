"""Listens to /numbers for five messages, prints them with the middleware's numbers, and leaves."""

from __future__ import annotations

import json
from typing import Any

import rclpy
from std_msgs.msg import Int64

received: list[tuple[int, int]] = []


def on_number(message: Int64, info: dict[str, Any]) -> None:
    received.append((message.data, info["publication_sequence_number"]))


rclpy.init()
node = rclpy.create_node("numbering_listener")
node.create_subscription(Int64, "/numbers", on_number, 100)
while len(received) < 5:
    rclpy.spin_once(node)
print(json.dumps(received), flush=True)
node.destroy_node()
rclpy.shutdown()
