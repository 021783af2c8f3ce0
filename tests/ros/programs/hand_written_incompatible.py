"""Plain rclpy nodes with incompatible endpoints, for the tests of 'compose doctor'.

/lab/scanner publishes /lab/scan (PointStamped, best effort, 50 Hz, stamped a quarter of a second
ago), which /lab/mapper requests reliably, and with each /lab/plain (Int32). It and /lab/odd
publish /lab/mixed, with different types; two nodes have the name /lab/twin. The action server of
/lab/endless never ends a goal. Prints ``ready`` at the start.
"""

from __future__ import annotations

import time
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from geometry_msgs.msg import PointStamped
from rclpy.action import ActionServer
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Int32, String

from tests.ros.programs.spinning import spin

AGE = Duration(seconds=0.25)


def work_forever(_: Any) -> Navigate.Result:
    while rclpy.ok():
        time.sleep(0.02)
    return Navigate.Result()


def main() -> None:
    rclpy.init()
    scanner, mapper = (Node(name, namespace="/lab") for name in ("scanner", "mapper"))
    twin, other_twin = (Node("twin", namespace="/lab") for _ in range(2))
    scans = scanner.create_publisher(PointStamped, "scan", qos_profile_sensor_data)
    plain = scanner.create_publisher(Int32, "plain", 10)

    def scan() -> None:
        message = PointStamped()
        message.header.stamp = (scanner.get_clock().now() - AGE).to_msg()
        scans.publish(message)
        plain.publish(Int32())

    scanner.create_timer(0.02, scan)
    mapper.create_subscription(PointStamped, "scan", lambda _: None, 10)
    scanner.create_publisher(Int32, "mixed", 10)
    # A participant of Fast DDS has a topic with one type only: the other needs another.
    context = Context()
    context.init([])
    odd = Node("odd", namespace="/lab", context=context)
    odd.create_publisher(String, "mixed", 10)
    server = ActionServer(mapper, Navigate, "endless", work_forever)
    spin(scanner, mapper, twin, other_twin, executor=MultiThreadedExecutor(3))
    server.destroy()  # the process may take long to end, with a participant that responds


if __name__ == "__main__":
    main()
