"""The pipeline: bring-up, motion of the robot, service, action and tear-down."""

from __future__ import annotations

from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.qos import QoSPresetProfiles

from tests.ros.support.pipeline import (
    NODES,
    check_the_drive,
    check_the_navigation,
)
from tests.ros.support.system_process import ExternalNode, RunningSystem


def test_the_robot_follows_the_planned_path(external: ExternalNode) -> None:
    commands = external.listen(Twist, "/motor_commands")
    odometry = external.listen(Odometry, "/sensor_data", QoSPresetProfiles.SENSOR_DATA.value)
    # A straight path that is long enough for a slow discovery.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[6.0, 0.0]"):
        external.spin_until(lambda: bool(odometry) and odometry[-1].pose.pose.position.x > 5.9)
    check_the_drive(commands, odometry, line_m=0.0)


def test_an_external_node_navigates_and_cancels(external: ExternalNode) -> None:
    # Without waypoints the robot waits for goals.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[]"):
        external.wait_for_state(NODES[-1], "active")
        check_the_navigation(external)
