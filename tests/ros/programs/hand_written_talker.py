"""A plain rclpy node with one of each kind of endpoint, for the tests of commands.

Node /lab/talker publishes /lab/count (Int32, 50 Hz, best effort), /lab/text (String, transient
local, once) and /lab/received with what it receives on /lab/in; serves /lab/add (SetBool) and
the action /lab/navigate, which rejects a max_velocity of 0 and works until canceled at -1; has
parameters. Prints ``ready`` at the start and counts the messages it sent on /lab/count.
"""

from __future__ import annotations

import time
from typing import Any

import rclpy
from composer_interfaces.action import Navigate
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool

from tests.ros.programs.spinning import spin


class Talker(Node):
    def __init__(self) -> None:
        super().__init__("talker", namespace="/lab")
        self.count = 0
        self.counts = self.create_publisher(Int32, "count", qos_profile_sensor_data)
        self.create_timer(0.02, self.tick)
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.text = self.create_publisher(String, "text", kept)
        self.text.publish(String(data="x" * 200))
        self.received = self.create_publisher(String, "received", kept)
        self.create_subscription(String, "in", self.received.publish, 10)
        self.create_service(SetBool, "add", self.answer)
        self.server = ActionServer(
            self,
            Navigate,
            "navigate",
            self.execute,
            callback_group=ReentrantCallbackGroup(),
            goal_callback=self.accept,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        bounds = [FloatingPointRange(from_value=0.0, to_value=5.0)]
        self.declare_parameter(
            "speed", 1.5, ParameterDescriptor(description="How fast.", floating_point_range=bounds)
        )
        self.declare_parameter("name", "robot")
        self.declare_parameter("gains", [1.0, 2.0])
        self.declare_parameter("counts", [1, 2])
        self.declare_parameter("limits.reach", 1.0)
        self.declare_parameter("note", "old", ParameterDescriptor(dynamic_typing=True))

    def tick(self) -> None:
        self.counts.publish(Int32(data=self.count))
        self.count += 1

    def answer(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success = request.data
        response.message = "switched"
        return response

    def accept(self, goal: Navigate.Goal) -> GoalResponse:
        return GoalResponse.REJECT if goal.max_velocity == 0.0 else GoalResponse.ACCEPT

    def execute(self, handle: Any) -> Navigate.Result:
        while not self.count_subscribers("navigate/_action/feedback"):
            time.sleep(0.005)  # a goal may be there before the subscription is discovered
        steps = 3 if handle.request.max_velocity > 0.0 else 100_000
        for step in range(steps):
            if handle.is_cancel_requested:
                handle.canceled()
                return Navigate.Result(message="stopped")
            time.sleep(0.05)
            handle.publish_feedback(Navigate.Feedback(progress_percent=float(step)))
        handle.succeed()
        return Navigate.Result(success=True, message="there", distance_traveled=2.5)


if __name__ == "__main__":
    rclpy.init()
    spin(Talker(), executor=MultiThreadedExecutor(4))
