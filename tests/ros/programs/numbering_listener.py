"""Listens to /numbers for five messages, prints them with the middleware's numbers, and leaves."""

from __future__ import annotations

import json
from typing import Any

import rclpy
from std_msgs.msg import Int64

heard: list[tuple[int, int]] = []


def hear(message: Int64, info: dict[str, Any]) -> None:
    heard.append((message.data, info["publication_sequence_number"]))


rclpy.init()
node = rclpy.create_node("numbering_listener")
node.create_subscription(Int64, "/numbers", hear, 100)
while len(heard) < 5:
    rclpy.spin_once(node)
print(json.dumps(heard), flush=True)
node.destroy_node()
rclpy.shutdown()
