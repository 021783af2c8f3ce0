"""Hand-written equivalent of systems/pipeline.yaml: rclpy nodes on a SingleThreadedExecutor.

The topics, types, QoS, rates and algorithms are those of the node types in ``nodes/``, without
lifecycle. Parameters are read once, and the service is called with a done-callback.
``python -m benchmarks.baseline_pipeline`` runs it until Ctrl-C.
"""

from __future__ import annotations

import json
import math
from bisect import bisect_right
from functools import partial

import rclpy
from builtin_interfaces.msg import Time
from composer_interfaces.action import Navigate
from composer_interfaces.srv import PlanTrajectory
from geometry_msgs.msg import Point, PoseStamped, Twist
from nav_msgs.msg import Odometry, Path
from rclpy.action import ActionServer
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future

NANOSECONDS = 1_000_000_000
ODOMETRY_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
COMMAND_QOS = QoSProfile(depth=10)
ODOMETRY_HZ, CONTROL_HZ, PLAN_PERIOD_S = 30.0, 50.0, 0.2
WAYPOINTS = [2.0, 0.0, 2.0, 1.0, 0.0, 1.0, 0.0, 0.0]


class SensorSimulator(Node):
    """A robot in the plane: commanded velocity in, odometry out."""

    def __init__(self) -> None:
        super().__init__("sensor_simulator", namespace="/perception")
        self.max_acceleration = self.declare_parameter("max_acceleration", 2.0).value
        self.command_timeout_ms = self.declare_parameter("command_timeout_ms", 500.0).value
        self.x, self.y = self.declare_parameter("start", [0.0, 0.0]).value
        self.rate_hz = self.declare_parameter("rate_hz", ODOMETRY_HZ).value
        self.velocity_x = self.velocity_y = 0.0
        self.sent = 0
        self.command = Twist()
        self.commanded_at_s = self.stepped_at_s = now_s(self)

    def create_entities(self) -> None:
        self.odometry = self.create_publisher(Odometry, "/sensor_data", ODOMETRY_QOS)
        self.create_subscription(Twist, "/motor_commands", self.on_command, COMMAND_QOS)
        self.create_timer(1.0 / self.rate_hz, self.step)

    def on_command(self, message: Twist) -> None:
        self.command = message
        self.commanded_at_s = now_s(self)

    def step(self) -> None:
        time_s = now_s(self)
        elapsed_s, self.stepped_at_s = time_s - self.stepped_at_s, time_s
        self.accelerate(elapsed_s, time_s)
        self.x += self.velocity_x * elapsed_s
        self.y += self.velocity_y * elapsed_s
        message = Odometry()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = "odom"
        message.child_frame_id = "base_link"
        message.pose.pose.position.x = self.x
        message.pose.pose.position.y = self.y
        message.pose.pose.orientation.w = 1.0
        message.twist.twist.linear.x = self.velocity_x
        message.twist.twist.linear.y = self.velocity_y
        self.odometry.publish(message)
        self.sent += 1

    def accelerate(self, elapsed_s: float, time_s: float) -> None:
        is_fresh = (time_s - self.commanded_at_s) * 1000.0 <= self.command_timeout_ms
        target = self.command.linear if is_fresh else Twist().linear
        change_x, change_y = target.x - self.velocity_x, target.y - self.velocity_y
        change = math.hypot(change_x, change_y)
        possible = self.max_acceleration * elapsed_s
        share = 1.0 if change <= possible else possible / change
        self.velocity_x += share * change_x
        self.velocity_y += share * change_y


class Planner(Node):
    """Samples the line from start to goal, evenly in time."""

    def __init__(self) -> None:
        super().__init__("planner", namespace="/planning")
        self.max_velocity = self.declare_parameter("max_velocity", 1.0).value
        self.period_s = self.declare_parameter("sample_period_ms", 100.0).value / 1000.0
        self.odometry: Odometry | None = None

    def create_entities(self) -> None:
        self.create_subscription(Odometry, "/sensor_data", self.on_odometry, ODOMETRY_QOS)
        self.create_service(PlanTrajectory, "/plan_trajectory", self.plan)

    def on_odometry(self, message: Odometry) -> None:
        self.odometry = message

    def plan(
        self, request: PlanTrajectory.Request, response: PlanTrajectory.Response
    ) -> PlanTrajectory.Response:
        if self.odometry is None:
            response.message = "no odometry received yet: the frame of the path is unknown"
            return response
        response.path = self.path(request, self.odometry.header.frame_id)
        response.success = True
        response.message = f"{len(response.path.poses)} points"
        return response

    def path(self, request: PlanTrajectory.Request, frame_id: str) -> Path:
        start, goal = request.start, request.goal
        velocity = min(request.max_velocity, self.max_velocity)
        length = math.dist((start.x, start.y, start.z), (goal.x, goal.y, goal.z))
        steps = max(1, math.ceil(length / (velocity * self.period_s)))
        yaw = math.atan2(goal.y - start.y, goal.x - start.x)
        path = Path()
        path.header.frame_id = frame_id
        path.header.stamp = self.get_clock().now().to_msg()
        for step in range(steps + 1):
            pose = PoseStamped()
            pose.header.frame_id = frame_id
            pose.header.stamp = later(path.header.stamp, step * self.period_s)
            pose.pose.position = between(start, goal, step / steps)
            pose.pose.orientation.z = math.sin(yaw / 2.0)
            pose.pose.orientation.w = math.cos(yaw / 2.0)
            path.poses.append(pose)
        return path


class MotorController(Node):
    """Follows planned paths between waypoints in closed loop."""

    def __init__(self) -> None:
        super().__init__("motor_controller", namespace="/control")
        self.max_velocity = self.declare_parameter("max_velocity", 1.0).value
        self.cruise_share = self.declare_parameter("cruise_share", 0.8).value
        self.position_gain = self.declare_parameter("position_gain", 1.5).value
        self.tolerance = self.declare_parameter("tolerance", 0.05).value
        self.waypoints = self.declare_parameter("waypoints", WAYPOINTS).value
        self.rate_hz = self.declare_parameter("rate_hz", CONTROL_HZ).value
        self.position: Point | None = None
        self.points: list[Point] = []
        self.times_s: list[float] = []
        self.planning = False
        self.next_waypoint = 0
        self.distance_traveled = 0.0
        self.sent = 0

    def create_entities(self) -> None:
        self.create_subscription(Odometry, "/sensor_data", self.on_odometry, ODOMETRY_QOS)
        self.planner = self.create_client(PlanTrajectory, "/plan_trajectory")
        self.navigate = ActionServer(self, Navigate, "/navigate", self.on_navigate)
        self.commands = self.create_publisher(Twist, "/motor_commands", COMMAND_QOS)
        self.create_timer(1.0 / self.rate_hz, self.control)
        self.create_timer(PLAN_PERIOD_S, self.plan)

    def on_odometry(self, message: Odometry) -> None:
        position = message.pose.pose.position
        if self.position is not None:
            self.distance_traveled += distance(self.position, position)
        self.position = position

    def control(self) -> None:
        command = Twist()
        if self.points and self.position is not None:
            command.linear.x, command.linear.y = self.velocity(self.position)
        self.commands.publish(command)
        self.sent += 1

    def plan(self) -> None:
        if self.planning or self.position is None or not self.planner.service_is_ready():
            return
        if self.points:
            if distance(self.position, self.points[-1]) > self.tolerance:
                return
            self.next_waypoint += 1
        index = self.next_waypoint % (len(self.waypoints) // 2)
        goal = Point(x=self.waypoints[2 * index], y=self.waypoints[2 * index + 1])
        cruise = self.cruise_share * self.max_velocity
        request = PlanTrajectory.Request(start=self.position, goal=goal, max_velocity=cruise)
        self.planning = True
        self.planner.call_async(request).add_done_callback(partial(self.follow, goal))

    def follow(self, goal: Point, answer: Future) -> None:
        self.planning = False
        response = answer.result()
        where = f"({goal.x:.2f}, {goal.y:.2f}): {response.message}"
        if not response.success:
            self.get_logger().warning(f"no path to {where}")
            return
        self.get_logger().info(f"driving to {where}")
        poses = response.path.poses
        self.points = [pose.pose.position for pose in poses]
        self.times_s = [pose.header.stamp.sec + pose.header.stamp.nanosec * 1e-9 for pose in poses]

    def velocity(self, position: Point) -> tuple[float, float]:
        target, velocity_x, velocity_y = self.reference(now_s(self))
        velocity_x += self.position_gain * (target.x - position.x)
        velocity_y += self.position_gain * (target.y - position.y)
        excess = math.hypot(velocity_x, velocity_y) / self.max_velocity
        if excess > 1.0:
            velocity_x, velocity_y = velocity_x / excess, velocity_y / excess
        return velocity_x, velocity_y

    def reference(self, time_s: float) -> tuple[Point, float, float]:
        index = bisect_right(self.times_s, time_s)
        if index == 0:
            return self.points[0], 0.0, 0.0
        if index == len(self.points):
            return self.points[-1], 0.0, 0.0
        before, after = self.points[index - 1], self.points[index]
        period_s = self.times_s[index] - self.times_s[index - 1]
        share = (time_s - self.times_s[index - 1]) / period_s
        step_x, step_y = after.x - before.x, after.y - before.y
        target = Point(x=before.x + share * step_x, y=before.y + share * step_y)
        return target, step_x / period_s, step_y / period_s

    def on_navigate(self, goal: object) -> Navigate.Result:
        """Abort: no goals are sent; the server exists for its idle cost."""
        goal.abort()
        return Navigate.Result(message="this is a measurement")


def now_s(node: Node) -> float:
    return node.get_clock().now().nanoseconds / NANOSECONDS


def distance(first: Point, second: Point) -> float:
    return math.hypot(second.x - first.x, second.y - first.y)


def between(start: Point, goal: Point, share: float) -> Point:
    return Point(
        x=start.x + share * (goal.x - start.x),
        y=start.y + share * (goal.y - start.y),
        z=start.z + share * (goal.z - start.z),
    )


def later(stamp: Time, seconds: float) -> Time:
    nanoseconds = stamp.sec * NANOSECONDS + stamp.nanosec + round(seconds * NANOSECONDS)
    return Time(sec=nanoseconds // NANOSECONDS, nanosec=nanoseconds % NANOSECONDS)


def main() -> None:
    """Run until Ctrl-C, then print the number of messages sent."""
    rclpy.init()
    sensor, planner, motor = SensorSimulator(), Planner(), MotorController()
    executor = SingleThreadedExecutor()
    for node in (sensor, planner, motor):
        node.create_entities()
        executor.add_node(node)
    print("ready", flush=True)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        print(json.dumps({"sensor_data": sensor.sent, "motor_commands": motor.sent}), flush=True)


if __name__ == "__main__":
    main()
