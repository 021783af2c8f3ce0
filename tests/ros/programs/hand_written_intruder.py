"""A plain rclpy process that puts a String on the pipeline's odometry topic, undeclared.

Prints ``ready``.
"""

from __future__ import annotations

import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import String


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("intruder")
    publisher = node.create_publisher(String, "/sensor_data", 10)
    node.create_timer(0.1, lambda: publisher.publish(String(data="x")))
    print("ready", flush=True)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit(0)


if __name__ == "__main__":
    main()
