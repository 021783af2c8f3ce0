"""A plain rclpy process with nodes for the commands.

Prints ``ready`` once its services are there. It has lifecycle nodes /other/planner, /other/arm
and /planning/planner; arm refuses to be configured, and planner in /other takes its time.
"""

from __future__ import annotations

import sys
import time

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn


class Arm(LifecycleNode):
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.FAILURE


class Slow(LifecycleNode):
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        time.sleep(6.0)
        return TransitionCallbackReturn.SUCCESS


def main() -> None:
    rclpy.init()
    executor = MultiThreadedExecutor(4)
    for node in (
        LifecycleNode("planner", namespace="/planning"),
        Slow("planner", namespace="/other"),
        Arm("arm", namespace="/other"),
    ):
        executor.add_node(node)
    print("ready", flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit(0)


if __name__ == "__main__":
    main()
