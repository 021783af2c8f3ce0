"""Subscribes to a topic as ``ros2 topic echo`` does: with the QoS profile of its publisher.

Prints ``ready``, then the number of messages that were lost before the third one arrived.
"""

from __future__ import annotations

import sys
import time

import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


def main() -> None:
    topic = sys.argv[1]
    rclpy.init()
    node = rclpy.create_node("echo")
    while not node.count_publishers(topic):
        time.sleep(0.01)
    print("ready", flush=True)
    lost, received = [], []
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


if __name__ == "__main__":
    main()
