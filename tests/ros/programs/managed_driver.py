"""A lifecycle node as users have it, which publishes while it is active."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from std_msgs.msg import String


class ManagedDriver(LifecycleNode):
    def __init__(self, name: str = "some_managed_driver", **options: Any) -> None:
        super().__init__(name, **options)
        self.declare_parameter("refuse", "")

    def on_configure(self, _: Any) -> TransitionCallbackReturn:
        self.words = self.create_lifecycle_publisher(String, "words", 10)
        self.ticks = self.create_timer(0.05, lambda: self.words.publish(String(data="managed")))
        return self.answer("configure")

    def on_activate(self, state: Any) -> TransitionCallbackReturn:
        super().on_activate(state)
        if self.get_parameter("refuse").value == "exit":
            sys.exit(4)
        return self.answer("activate")

    def on_cleanup(self, _: Any) -> TransitionCallbackReturn:
        self.destroy_timer(self.ticks)
        self.destroy_lifecycle_publisher(self.words)
        return TransitionCallbackReturn.SUCCESS

    def answer(self, transition: str) -> TransitionCallbackReturn:
        if self.get_parameter("refuse").value == f"hang in {transition}":
            time.sleep(60.0)
        if self.get_parameter("refuse").value == transition:
            return TransitionCallbackReturn.FAILURE
        return TransitionCallbackReturn.SUCCESS


def main() -> None:
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(ManagedDriver())


if __name__ == "__main__":
    main()
