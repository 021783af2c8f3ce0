"""The example systems of robots: the pipeline, the fleet, and frames of tf2."""

from __future__ import annotations

import math
import os

import pytest
from geometry_msgs.msg import PointStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSPresetProfiles

from tests.ros.support.pipeline import NODES, check_the_drive, check_the_navigation
from tests.ros.support.system_process import ExternalNode, RunningSystem

SENSOR_DATA = QoSPresetProfiles.SENSOR_DATA.value


def test_the_robot_follows_the_planned_path(external: ExternalNode) -> None:
    commands = external.listen(Twist, "/motor_commands")
    odometry = external.listen(Odometry, "/sensor_data", SENSOR_DATA)
    # A straight path that is long enough for a slow discovery.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[6.0, 0.0]"):
        external.spin_until(lambda: bool(odometry) and odometry[-1].pose.pose.position.x > 5.9)
    check_the_drive(commands, odometry, line_m=0.0)


def test_an_external_node_navigates_and_cancels(external: ExternalNode) -> None:
    # Without waypoints the robot waits for goals.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[]"):
        external.wait_for_state(NODES[-1], "active")
        check_the_navigation(external)


def test_the_robots_are_independent(external: ExternalNode) -> None:
    odometry = {
        robot: external.listen(Odometry, f"/{robot}/odometry", SENSOR_DATA)
        for robot in ("alpha", "beta")
    }
    # Each robot drives on its own line, so its position identifies it at any time.
    waypoints = ("alpha_controller.waypoints=[6.0, 0.0]", "beta_controller.waypoints=[6.0, 5.0]")
    options = [word for value in waypoints for word in ("--set", value)]
    with RunningSystem("systems/fleet.yaml", *options) as system:
        system.wait_for(r"9 of 9 nodes active")
        system.wait_for(r"alpha_controller.*driving to")
        system.wait_for(r"beta_controller.*driving to")
        external.spin_until(lambda: all(odometry.values()))
        code, _ = system.stop()
    assert code == 0
    for robot, line in (("alpha", 0.0), ("beta", 5.0)):
        assert all(abs(message.pose.pose.position.y - line) < 0.1 for message in odometry[robot])


def test_an_obstacle_is_found_on_the_map(external: ExternalNode) -> None:
    if os.environ.get("CI") != "true":
        pytest.importorskip("tf2_msgs", reason="make test builds it")
    found = external.listen(PointStamped, "/obstacles")
    with RunningSystem("systems/frames.yaml") as system:
        external.spin_until(lambda: len(found) >= 2)
        system.wait_for(r"obstacle_finder.*obstacle at x")
    for obstacle in found:
        assert obstacle.header.frame_id == "map"
        assert obstacle.point.z == pytest.approx(0.3)
        # The robot drives around this point, which is always 2 m to its left.
        distance_m = math.hypot(obstacle.point.x - 10.0, obstacle.point.y - 7.0)
        assert distance_m == pytest.approx(math.hypot(0.2, 1.5 - 2.0), abs=1e-3)
    assert found[0].point != found[1].point
