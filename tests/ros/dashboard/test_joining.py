"""A browser may come back at any time while the dashboard leaves the ROS graph."""

from __future__ import annotations

import threading
from contextlib import ExitStack

import pytest

from composer.dashboard import ros_side
from composer.dashboard.feeds import Feeds
from composer.dashboard.forms import Forms
from composer.dashboard.ros_side import RosGraphSide, RosSide
from composer.interfaces import Interfaces
from tests.ros.support.in_process import PATIENCE_S, wait_until


class SlowToLeave(RosSide):
    """Leaves the ROS graph for the first time only when it may."""

    def __init__(self) -> None:
        super().__init__(Feeds(), Forms(Interfaces.load()))
        self.leaving, self.may_leave = threading.Event(), threading.Event()
        self.threads: list[threading.Thread] = []

    def _join(self, stack: ExitStack) -> RosGraphSide:
        side = super()._join(stack)
        if not self.threads:
            stack.callback(self.may_leave.wait, PATIENCE_S)
            stack.callback(self.leaving.set)
        self.threads.append(threading.current_thread())
        return side


def test_a_browser_that_comes_while_leaving_is_served(
    ros_domain_id: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ros_side, "LINGER_S", 0.0)
    ros = SlowToLeave()
    try:
        ros.enter()
        wait_until(lambda: ros.state == "ready")
        ros.leave()
        assert ros.leaving.wait(PATIENCE_S)
        ros.enter()
        wait_until(lambda: len(ros.threads) == 2 and ros.state == "ready")
        ros.may_leave.set()
        ros.threads[0].join(PATIENCE_S)
        assert ros.state == "ready"
    finally:
        ros.may_leave.set()
        ros.leave()
        ros.close(PATIENCE_S)
