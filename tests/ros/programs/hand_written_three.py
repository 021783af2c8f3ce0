"""Three nodes as users write them with rclpy: a driver, a lifecycle node, and a client."""

from __future__ import annotations

import rclpy
from composer_interfaces.action import Navigate
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.action import ActionServer
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from std_msgs.msg import String
from std_srvs.srv import Trigger


class Lidar(Node):
    def __init__(self) -> None:
        super().__init__("lidar", namespace="/perception")
        rate = ParameterDescriptor(
            description="Rate of the scans.",
            floating_point_range=[FloatingPointRange(from_value=1.0, to_value=50.0, step=0.0)],
        )
        self.declare_parameter("rate_hz", 10.0, rate)
        self.declare_parameter("frame", "laser", ParameterDescriptor(read_only=True))
        self.declare_parameter("angles", [0.0, 1.5])
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_publisher(String, "scan", qos_profile_sensor_data)
        self.create_publisher(String, "~/status", latched)


class Planner(LifecycleNode):
    def __init__(self) -> None:
        super().__init__("planner")
        self.create_subscription(String, "/perception/scan", print, qos_profile_sensor_data)
        self.create_service(Trigger, "plan", lambda _, response: response)
        qos = QoSProfile(depth=3, deadline=Duration(seconds=0.5))
        self.create_lifecycle_publisher(String, "path", qos)


class Base(Node):
    def __init__(self) -> None:
        super().__init__("driver", namespace="/base")
        best_effort = QoSProfile(depth=3, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(String, "/path", print, best_effort)
        self.create_client(Trigger, "/plan")
        self.server = ActionServer(self, Navigate, "navigate", lambda _: Navigate.Result())
        self.declare_parameter("wheels.count", 4)
        self.declare_parameter("names", ["a", "b ${x}"])


def main() -> None:
    rclpy.init()
    executor = SingleThreadedExecutor()
    for node in (Lidar(), Planner(), Base()):
        executor.add_node(node)
    print("ready", flush=True)
    executor.spin()


if __name__ == "__main__":
    main()
