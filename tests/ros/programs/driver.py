"""A driver as users have it: a plain rclpy node with a parameter, a publisher and a service."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from rclpy.action import ActionServer
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger


class Driver(Node):
    def __init__(self) -> None:
        super().__init__("some_driver")
        self.declare_parameter("rate", 1.0)
        self.declare_parameter("gains", [0.0])
        self.declare_parameter("label", "none")
        self.words = self.create_publisher(String, "words", 10)
        self.echo = self.create_publisher(String, "~/echo", 10)
        self.create_subscription(String, "orders", self.on_order, 10)
        self.create_service(Trigger, "reset", self.on_reset)
        self.server = ActionServer(self, Navigate, "navigate", self.on_goal)
        self.create_timer(1.0 / self.get_parameter("rate").value, self.on_tick)
        names = (self.words.topic_name, self.echo.topic_name, self.resolve_service_name("reset"))
        values = {name: self.get_parameter(name).value for name in ("rate", "gains", "label")}
        level = self.get_logger().get_effective_level().name
        found = [self.get_fully_qualified_name(), *names, json.dumps(dict(values)), level]
        print("I am", *found, *sys.argv[1 : sys.argv.index("--ros-args")], flush=True)
        self.get_logger().info("ready")

    def on_tick(self) -> None:
        self.words.publish(String(data="tick"))

    def on_order(self, message: String) -> None:
        self.echo.publish(message)

    def on_reset(self, _: Any, response: Any) -> Any:
        response.success = True
        return response

    def on_goal(self, goal: Any) -> Any:
        goal.succeed()
        return Navigate.Result()


def main() -> None:
    if "--stubborn" in sys.argv:
        rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    else:
        rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Driver())


if __name__ == "__main__":
    main()
