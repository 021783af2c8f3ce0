"""Two robots from one file: each one has the namespace and the parameters of its include."""

from __future__ import annotations

from nav_msgs.msg import Odometry
from rclpy.qos import QoSPresetProfiles

from tests.ros.support.system_process import ExternalNode, RunningSystem

SENSOR_DATA = QoSPresetProfiles.SENSOR_DATA.value


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
