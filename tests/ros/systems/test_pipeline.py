"""The pipeline: bring-up, motion of the robot, service, action and tear-down."""

from __future__ import annotations

import re
import signal

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSPresetProfiles

from tests.ros.support.in_process import end_limit_s
from tests.ros.support.pipeline import (
    NODES,
    check_a_deactivated_planner,
    check_the_drive,
    check_the_navigation,
    check_the_planner,
)
from tests.ros.support.system_process import ExternalNode, RunningSystem


def test_nodes_are_activated_in_dependency_order(external: ExternalNode) -> None:
    with RunningSystem("systems/pipeline.yaml") as system:
        for node in NODES:
            external.wait_for_state(node, "active")
        code, took_s = system.stop(signal.SIGINT)
    activated = _order(system, r"active$|active\b")
    assert code == 0
    assert took_s < end_limit_s()
    assert activated.index("/planning/planner") < activated.index("/control/motor_controller")
    assert "Traceback" not in system.output


def _order(system: RunningSystem, pattern: str) -> list[str]:
    return [
        node
        for line in system.lines
        for node in NODES
        if node in line and re.search(pattern, line) and "inactive" not in line
    ]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_every_signal_shuts_down_cleanly(external: ExternalNode, number: signal.Signals) -> None:
    with RunningSystem("systems/pipeline.yaml") as system:
        external.wait_for_state(NODES[-1], "active")
        code, took_s = system.stop(number)
    assert code == 0
    assert took_s < end_limit_s()


def test_the_robot_follows_the_planned_path(external: ExternalNode) -> None:
    commands = external.listen(Twist, "/motor_commands")
    odometry = external.listen(Odometry, "/sensor_data", QoSPresetProfiles.SENSOR_DATA.value)
    # A straight path that is long enough for a slow discovery.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[6.0, 0.0]"):
        external.spin_until(lambda: bool(odometry) and odometry[-1].pose.pose.position.x > 5.9)
    check_the_drive(commands, odometry, line_m=0.0)


def test_an_external_node_calls_the_planner(external: ExternalNode) -> None:
    with RunningSystem("systems/pipeline.yaml"):
        check_the_planner(external)


def test_an_external_node_navigates_and_cancels(external: ExternalNode) -> None:
    # Without waypoints the robot waits for goals.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[]"):
        external.wait_for_state(NODES[-1], "active")
        check_the_navigation(external)


def test_a_deactivated_planner_rejects_requests(external: ExternalNode) -> None:
    with RunningSystem("systems/pipeline.yaml"):
        external.wait_for_state(NODES[-1], "active")
        check_a_deactivated_planner(external)
