"""A browser may come back at any time while the dashboard leaves the ROS graph."""

from __future__ import annotations

import subprocess
import sys
import threading
from typing import Self

import pytest

from composer.client import shared_session
from composer.client.shared_session import SharedSession
from composer.dashboard import ros_side
from composer.dashboard.feeds import Feeds
from composer.dashboard.forms import Forms
from composer.dashboard.ros_side import RosSide
from composer.interfaces import Interfaces
from tests.ros.support.in_process import PATIENCE_S, wait_until


def test_a_browser_that_comes_while_leaving_is_served(
    ros_domain_id: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    leaving, may_leave = threading.Event(), threading.Event()
    threads: list[threading.Thread] = []

    class SlowToLeave(SharedSession):
        """Leaves the ROS graph for the first time only when it may."""

        def __enter__(self) -> Self:
            threads.append(threading.current_thread())
            return super().__enter__()

        def __exit__(self, *error: object) -> None:
            if threading.current_thread() is threads[0]:
                leaving.set()
                may_leave.wait(PATIENCE_S)
            super().__exit__(*error)

    monkeypatch.setattr(ros_side, "LINGER_S", 0.0)
    monkeypatch.setattr(shared_session, "SharedSession", SlowToLeave)
    ros = RosSide(Feeds(), Forms(Interfaces.load()))
    try:
        ros.enter()
        wait_until(lambda: ros.state == "ready")
        ros.leave()
        assert leaving.wait(PATIENCE_S)
        ros.enter()
        wait_until(lambda: len(threads) == 2 and ros.state == "ready")
        may_leave.set()
        threads[0].join(PATIENCE_S)
        assert ros.state == "ready"
    finally:
        may_leave.set()
        ros.leave()
        ros.close(PATIENCE_S)


#: A browser comes while the dashboard imports rclpy, in the middle of the package.
EARLY_BROWSER = """
import builtins, threading, time
from composer.dashboard.feeds import Feeds
from composer.dashboard.forms import Forms
from composer.dashboard.ros_side import RosSide
from composer.interfaces import Interfaces

def interrupted(name, *rest):
    if name == "rclpy.signals" and threading.current_thread().name == "prepare":
        side.enter()
        threading.Event().wait(0.5)  # for the thread of the browser
    return found(name, *rest)

found, builtins.__import__ = builtins.__import__, interrupted
side = RosSide(Feeds(), Forms(Interfaces.load()))
side.prepare()
while side.state not in ("ready", "failed"):
    time.sleep(0.01)
print(side.state, side.message)
side.leave()
side.close(5.0)
"""


def test_a_browser_that_comes_during_the_imports_is_served(ros_domain_id: int) -> None:
    command = (sys.executable, "-c", EARLY_BROWSER)
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.stdout, done.returncode) == ("ready \n", 0), done.stderr
    assert "Traceback" not in done.stderr
