"""A plain rclpy process that sends more than arrives, until it is killed.

Node /flood publishes numbered images on /big (best effort): a hundred large ones at once, then
small ones for a moment, and again. On /alive it asserts its liveliness every 20 ms of that moment;
its lease is 500 ms. Arguments: another lease in milliseconds, and the number of large ones. Prints
``ready`` at the start.
"""

from __future__ import annotations

import sys
import time

import rclpy
from rclpy.duration import Duration
from rclpy.qos import LivelinessPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Image
from std_msgs.msg import String

_LARGE, _SMALL = bytes(1_000_000), b""


def main() -> None:
    lease_ms, large = (int(text) for text in sys.argv[1:] or ("500", "100"))
    rclpy.init()
    node = rclpy.create_node("flood")
    big = node.create_publisher(Image, "big", qos_profile_sensor_data)
    qos = QoSProfile(
        depth=10,
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
        liveliness_lease_duration=Duration(nanoseconds=lease_ms * 1_000_000),
    )
    alive = node.create_publisher(String, "alive", qos)
    print("ready", flush=True)
    while not alive.get_subscription_count():
        time.sleep(0.01)  # rclpy cannot wait for a match
    number = 0
    while True:
        for data in [_LARGE] * large + [_SMALL] * 20:
            number += 1
            big.publish(Image(width=number, data=data))
            if data is _SMALL:
                alive.publish(String())
                time.sleep(0.02)  # what is lost of the flood shows when something arrives after it


if __name__ == "__main__":
    main()
