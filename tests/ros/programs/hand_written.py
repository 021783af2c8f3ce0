"""A plain rclpy process with nodes for the commands.

Prints ``ready`` once its services are there. It has lifecycle nodes /other/planner, /other/arm
and /planning/planner; arm refuses to be configured, and planner in /other takes its time. /arms has
two latched messages of arm.
"""

from __future__ import annotations

import time

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from tests.ros.programs.spinning import spin


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


if __name__ == "__main__":
    rclpy.init()
    arm = Arm("arm", namespace="/other")
    arm.publish_latched()
    spin(
        LifecycleNode("planner", namespace="/planning"),
        Slow("planner", namespace="/other"),
        arm,
        executor=MultiThreadedExecutor(4),
    )
