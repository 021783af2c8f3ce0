"""A handler may raise anything, at any time: the error is logged and counted, the node goes on."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from std_srvs.srv import Trigger

from tests.ros.support.in_process import Peer, finished, running, wait_until

SYSTEM = """
system: hostile
executors: {default: {kind: KIND}}
nodes:
  hostile:
    behavior: hostile:Hostile
    services:
      ask: {type: std_srvs/srv/Trigger, external: true}
      ask_later: {type: std_srvs/srv/Trigger, external: true}
    action_servers:
      drive: {type: composer_interfaces/action/Navigate, external: true}
    timers: {tick: {period_ms: 2}, later: {period_ms: 2}}
"""
MODULE = """
from composer_interfaces.action import Navigate
from composer.behavior import Behavior

class TextRaises(Exception):
    def __str__(self):
        raise ValueError("no text")

class TextIsANumber(Exception):
    def __str__(self):
        return 3

class ClassRaises(Exception):
    @property
    def __class__(self):
        raise RuntimeError("no class")

class ReprRaises:
    def __repr__(self):
        raise GeneratorExit

ERRORS = (TextRaises, TextIsANumber, ClassRaises, GeneratorExit, SystemExit, KeyboardInterrupt)

class Hostile(Behavior):
    def on_configure(self):
        self.ticks = self.later = self.asked = 0

    def on_tick(self):
        self.ticks += 1
        if self.ticks <= len(ERRORS):
            raise ERRORS[self.ticks - 1]

    async def on_drive(self, goal):
        if goal.request.max_velocity < len(ERRORS):
            raise ERRORS[int(goal.request.max_velocity)]
        return Navigate.Result(message="\\udc80")  # cannot be sent

    async def on_later(self):
        await self.clock.sleep(0)
        self.later += 1
        if self.later <= len(ERRORS):
            raise ERRORS[self.later - 1]

    def answer(self, response):
        self.asked += 1
        if self.asked <= len(ERRORS):
            raise ERRORS[self.asked - 1]
        if self.asked == len(ERRORS) + 1:
            return ReprRaises()
        if self.asked == len(ERRORS) + 2:
            response.message = "\\udc80"  # cannot be sent
        response.success = True
        return response

    def on_ask(self, request, response):
        return self.answer(response)

    async def on_ask_later(self, request, response):
        await self.clock.sleep(0)
        return self.answer(response)
"""
#: What the handlers of the services raise or return, in order.
REASONS = [
    "TextRaises: <its text is not available: __str__ failed>",
    "TextIsANumber: <its text is not available: __str__ failed>",
    "ClassRaises",
    "GeneratorExit",
    "SystemExit",
    "KeyboardInterrupt",
    "returned a ReprRaises whose __repr__ failed, not a Trigger.Response",
    "UnicodeEncodeError",
]


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_whatever_a_handler_raises_is_counted_and_answered(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    with running(SYSTEM.replace("KIND", kind), tmp_path, hostile=MODULE) as system:
        behavior = system.behavior("hostile")
        wait_until(lambda: behavior.ticks > 10 and behavior.later > 10, "timers that go on")
        for service in ("/ask", "/ask_later"):
            behavior.asked = 0
            for reason in REASONS:
                response = peer.call(Trigger, service)
                assert not response.success
                assert reason in response.message
            assert peer.call(Trigger, service).success
        client = peer.action_client(Navigate, "/drive")
        for number in range(7):
            goal = Navigate.Goal(max_velocity=float(number))
            handle = finished(peer.run(partial(client.send_goal_async, goal)))
            response = finished(peer.run(handle.get_result_async))
            assert response.status == GoalStatus.STATUS_ABORTED
        assert peer.state("/hostile") == "active"
    assert system.summary("/hostile").errors == 2 * 6 + 2 * len(REASONS) + 7
    log = system.log_text()
    assert "on_tick: TextRaises: <its text is not available: __str__ failed>\nTraceback" in log
    assert "composer/runtime" not in log, "only the lines of the user"
