"""A plain rclpy process with nodes for the commands.

Prints ``ready`` once its services are there. It has lifecycle nodes /other/planner, /other/arm
and /planning/planner; arm refuses to be configured, and planner in /other takes its time. /arms has
two latched messages of arm.
"""

from __future__ import annotations

import sys
import time

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


class Arm(LifecycleNode):
    def publish_latched(self) -> None:
        kept = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        latched = super(LifecycleNode, self).create_publisher(String, "/arms", kept)
        for text in ("left", "right"):
            latched.publish(String(data=text))

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        return TransitionCallbackReturn.FAILURE


class Slow(LifecycleNode):
    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        time.sleep(6.0)
        return TransitionCallbackReturn.SUCCESS


def main() -> None:
    rclpy.init()
    executor = MultiThreadedExecutor(4)
    arm = Arm("arm", namespace="/other")
    arm.publish_latched()
    for node in (
        LifecycleNode("planner", namespace="/planning"),
        Slow("planner", namespace="/other"),
        arm,
    ):
        executor.add_node(node)
    print("ready", flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit(0)


if __name__ == "__main__":
    main()
