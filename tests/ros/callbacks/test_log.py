"""What a node logs reaches /rosout, where every ROS tool looks for it."""

from __future__ import annotations

from pathlib import Path

from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile

from composer.model import LogLevel
from composer.runtime.host import HostOptions
from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, running, wait_until

LOUD = """
system: loud
nodes:
  loud:
    namespace: robot
    on_configure: {log: {level: debug, message: "a detail of {node}"}}
    on_activate: {log: {level: warn, message: "a warning"}}
"""


def test_a_late_listener_of_rosout_gets_the_log(tmp_path: Path, peer: Peer) -> None:
    late = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with running(LOUD, tmp_path, options=HostOptions(log_level=LogLevel.DEBUG)):
        heard = peer.listen(Log, "/rosout", late)
        wait_until(lambda: sum(message.name == "robot.loud" for message in heard) == 2)
    lines = [message for message in heard if message.name == "robot.loud"]
    assert [(line.level, line.msg) for line in lines] == [
        (Log.DEBUG, "a detail of /robot/loud"),
        (Log.WARN, "a warning"),
    ]
    assert lines[0].stamp.sec > 0


def test_what_is_below_the_level_is_not_logged(tmp_path: Path) -> None:
    with running(LOUD, tmp_path, options=HostOptions(log_level=LogLevel.WARN)) as system:
        system.wait_for_log("a warning")
    assert [str(event).partition("] ")[2] for event in system.reported(Logged)] == [
        "[WARN] [robot.loud] a warning"
    ]
