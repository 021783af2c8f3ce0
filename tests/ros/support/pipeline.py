"""What the nodes of the pipeline do, and their ROS graph, observed by an external node."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from composer_interfaces.srv import PlanTrajectory
from geometry_msgs.msg import Point, Twist
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.topic_endpoint_info import TopicEndpointInfo

from tests.ros.support.system_process import ExternalNode

NODES = ("/perception/sensor_simulator", "/planning/planner", "/control/motor_controller")
ROUNDING = 0.02  # in m/s and m
MAX_VELOCITY = 1.0  # the motor controller's default, in m/s
#: The number of looks at the graph without a change: more than a second, in which a busy machine
#: may not run a process.
STABLE = 30

Graph = frozenset[tuple[str, ...]]


def check_the_drive(commands: Sequence[Twist], odometry: Sequence[Odometry], line_m: float) -> None:
    """Check that the robot drove along a line parallel to the x axis, forward, within its limit."""
    speeds = [math.hypot(message.linear.x, message.linear.y) for message in commands]
    assert len(speeds) > 50
    assert 0.7 < max(speeds) <= MAX_VELOCITY + ROUNDING
    on_the_way = [message.pose.pose.position for message in odometry]
    assert max(abs(position.y - line_m) for position in on_the_way) < 0.05
    assert all(after.x >= before.x - ROUNDING for before, after in pairwise(on_the_way))
    for message in odometry:
        twist = message.twist.twist.linear
        assert math.hypot(twist.x, twist.y) <= MAX_VELOCITY + ROUNDING


def check_the_planner(external: ExternalNode) -> None:
    """Check the path that the planner returns, and that it refuses an invalid request."""
    start, goal = Point(x=1.0, y=1.0), Point(x=4.0, y=5.0)
    request = PlanTrajectory.Request(start=start, goal=goal, max_velocity=0.5)
    response = _wait_for_plan(external, request)
    refused = external.call(PlanTrajectory, "/plan_trajectory", PlanTrajectory.Request())
    assert response.success
    positions = [pose.pose.position for pose in response.path.poses]
    times_s = _seconds(response.path)
    assert _distance(positions[0], start) < 1e-9
    assert _distance(positions[-1], goal) < 1e-9
    for (before, after), (earlier, later) in zip(
        pairwise(positions), pairwise(times_s), strict=True
    ):
        assert _distance(before, after) / (later - earlier) <= 0.5 + ROUNDING
    assert times_s[-1] - times_s[0] == pytest.approx(5.0 / 0.5, abs=0.2)
    assert not refused.success
    assert "max_velocity" in refused.message


def _wait_for_plan(
    external: ExternalNode, request: PlanTrajectory.Request
) -> PlanTrajectory.Response:
    """Call the planner until it has received odometry and returns a path."""
    responses: list[PlanTrajectory.Response] = []

    def has_path() -> bool:
        responses.append(external.call(PlanTrajectory, "/plan_trajectory", request))
        return bool(responses[-1].success)

    external.spin_until(has_path)
    return responses[-1]


def check_the_navigation(external: ExternalNode) -> None:
    """Check a goal that the robot reaches from the origin, a second goal, and a canceled one."""
    client = external.action_client(Navigate, "/navigate")
    goal = Navigate.Goal(target=Point(x=0.0, y=1.0), max_velocity=1.0)
    outcome = external.result(external.result(client.send_goal_async(goal)).get_result_async())
    assert outcome.status == GoalStatus.STATUS_SUCCEEDED
    # The robot overshoots and returns if its controller is delayed: it brakes after half a second.
    assert 0.9 < outcome.result.distance_traveled < 3.0
    feedback: list[float] = []
    handle = external.result(
        client.send_goal_async(
            Navigate.Goal(target=Point(x=50.0, y=50.0), max_velocity=0.5),
            feedback_callback=lambda m: feedback.append(m.feedback.progress_percent),
        )
    )
    external.spin_until(lambda: bool(feedback) and feedback[-1] > feedback[0])
    busy = external.result(client.send_goal_async(goal))
    assert not busy.accepted
    external.result(handle.cancel_goal_async())
    outcome = external.result(handle.get_result_async())
    client.destroy()
    assert outcome.status == GoalStatus.STATUS_CANCELED
    assert outcome.result.message == "canceled on the way"


def check_a_deactivated_planner(external: ExternalNode) -> None:
    """Check that only an active planner answers requests."""
    request = PlanTrajectory.Request(goal=Point(x=1.0), max_velocity=0.5)
    _wait_for_plan(external, request)
    assert external.change_state("/planning/planner", "deactivate")
    refusal = external.call(PlanTrajectory, "/plan_trajectory", request)
    assert not refusal.success
    assert "/planning/planner" in refusal.message
    assert "inactive" in refusal.message
    assert external.state("/control/motor_controller") == "active"
    assert external.change_state("/planning/planner", "activate")
    _wait_for_plan(external, request)


def _seconds(path: Path) -> list[float]:
    return [pose.header.stamp.sec + pose.header.stamp.nanosec * 1e-9 for pose in path.poses]


def _distance(first: Point, second: Point) -> float:
    return math.dist((first.x, first.y, first.z), (second.x, second.y, second.z))


def graph_of(node: Node) -> Graph:
    """Return the endpoints of the pipeline's nodes: kind, node, name, type, QoS."""
    found: set[tuple[str, ...]] = set()
    for topic, _ in node.get_topic_names_and_types():
        for endpoint in node.get_publishers_info_by_topic(topic):
            found.add(("publisher", *_endpoint(topic, endpoint)))
        for endpoint in node.get_subscriptions_info_by_topic(topic):
            found.add(("subscription", *_endpoint(topic, endpoint)))
    for full_name in NODES:
        namespace, _, name = full_name.rpartition("/")
        with suppress(NodeNameNonExistentError):
            for service, types in node.get_service_names_and_types_by_node(name, namespace):
                found.add(("service", full_name, service, *types))
            for service, types in node.get_client_names_and_types_by_node(name, namespace):
                found.add(("client", full_name, service, *types))
    return frozenset(entry for entry in found if entry[1] in NODES)


def _endpoint(topic: str, endpoint: TopicEndpointInfo) -> tuple[str, ...]:
    qos = endpoint.qos_profile
    name = f"{endpoint.node_namespace}/{endpoint.node_name}"
    policies = (qos.reliability, qos.durability, qos.deadline, qos.lifespan, qos.liveliness)
    return (name, topic, endpoint.topic_type, *map(str, policies))


def stable_graph(observer: ExternalNode) -> Graph:
    """Return the graph once it has stopped to change."""
    seen: list[Graph] = []

    def is_stable() -> bool:
        seen.append(graph_of(observer.node))
        last = seen[-STABLE:]
        return len(last) == STABLE and len(set(last)) == 1 and bool(last[-1])

    observer.spin_until(is_stable)
    return seen[-1]
