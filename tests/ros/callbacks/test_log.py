"""Logs of nodes are published on /rosout, and errors are counted against a limit."""

from __future__ import annotations

from pathlib import Path

import pytest
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile

from composer.model import LogLevel
from composer.runtime.callbacks.log import ErrorLimit
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, running, wait_until

LIMIT_TEXT = "more than 2 errors within 10 s"
LOUD = """
system: loud
nodes:
  loud:
    namespace: robot
    on_configure: {log: {level: debug, message: "a detail of {node}"}}
    on_activate: {log: {level: warn, message: "a warning"}}
"""
HERE = "  here: {behavior: here:Here}\n"
HERE_MODULE = """
from composer.behavior import Behavior

class Here(Behavior):
    def on_activate(self):
        self.log.info("here")
"""


def test_a_late_subscription_of_rosout_receives_the_log(tmp_path: Path, peer: Peer) -> None:
    late = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    options = HostOptions(log_level=LogLevel.DEBUG)
    with running(LOUD + HERE, tmp_path, options=options, here=HERE_MODULE):
        messages = peer.listen(Log, "/rosout", late)
        wait_until(lambda: sum(message.name == "robot.loud" for message in messages) == 2)
        line = wait_until(lambda: next((item for item in messages if item.msg == "here"), None))
    lines = [message for message in messages if message.name == "robot.loud"]
    assert [(line.level, line.msg) for line in lines] == [
        (Log.DEBUG, "a detail of /robot/loud"),
        (Log.WARN, "a warning"),
    ]
    assert lines[0].stamp.sec > 0
    # Where a behavior has logged:
    assert (line.file, line.function, line.line) == (str(tmp_path / "here.py"), "on_activate", 6)


def test_messages_below_the_level_are_not_logged(tmp_path: Path) -> None:
    with running(LOUD, tmp_path, options=HostOptions(log_level=LogLevel.WARN)) as system:
        system.wait_for_log("a warning")
    assert [str(event).partition("] ")[2] for event in system.reported(Logged)] == [
        "[WARN] [robot.loud] a warning"
    ]


@pytest.mark.parametrize(
    ("times_s", "reports"),
    [
        ((1.0, 2.0), 0),
        ((1.0, 2.0, 3.0), 1),
        ((1.0, 2.0, 11.0), 1),
        ((1.0, 2.0, 11.1), 0),
        ((1.0, 2.0, 11.1, 11.2), 1),
        ((1.0, 2.0, 3.0, 4.0, 5.0, 6.0), 1),
    ],
)
def test_an_error_limit_is_reported_once(times_s: tuple[float, ...], reports: int) -> None:
    texts: list[str] = []
    limit = ErrorLimit(2, 10.0, texts.append)
    limit.start()
    for at_s in times_s:
        limit.count(at_s)
    assert texts == [LIMIT_TEXT] * reports


def test_an_error_limit_counts_from_each_start_except_while_it_is_paused() -> None:
    texts: list[str] = []
    limit = ErrorLimit(2, 10.0, texts.append)
    for at_s in (1.0, 1.1, 1.2):
        limit.count(at_s)
    assert texts == [], "not started"
    limit.start()
    limit.count(2.0)
    limit.count(2.1)
    limit.paused = True
    limit.count(2.2)
    assert texts == [], "paused"
    limit.paused = False
    limit.count(2.3)
    assert texts == [LIMIT_TEXT]
    limit.start()
    for at_s in (3.0, 3.1, 3.2):
        limit.count(at_s)
    assert texts == [LIMIT_TEXT] * 2
