"""What is reported of callbacks: logs, errors beyond a limit, growing states, changed messages."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger

from composer.model import LogLevel
from composer.runtime.callbacks.log import ErrorLimit
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import Logged
from tests.ros.support.in_process import Peer, finished, running, wait_until
from tests.ros.support.system_process import RunningSystem as InAProcess
from tests.ros.support.system_process import write_system

GROWING = """
system: growing
nodes:
  growing:
    state: {text: abcdefgh, list: [1, [2, 3]]}
    timers:
      text: {period_ms: 20, set: {text: "{state.text}{state.text}"}}
      list: {period_ms: 20, set: {list: ["{state.list}", "{state.list}"]}}
      whole: {period_ms: 20, set: {text: "{state.text}"}, log: "length {len(state.text)}"}
"""


def test_a_state_that_grows_without_end_is_an_error(tmp_path: Path) -> None:
    with running(GROWING, tmp_path) as system:
        text = system.wait_for_log("'set' of 'text'")
        system.wait_for_log("'set' of 'list'")
        system.wait_for_log("length 524288")  # the last value is kept, and other timers run
    assert "the value has more than 1000000 characters and items" in text
    assert system.end().exit_code == 0


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
    limit = ErrorLimit(2, 10.0, texts.append, lambda: True)
    limit.start()
    for at_s in times_s:
        limit.count(at_s)
    assert texts == [LIMIT_TEXT] * reports


def test_an_error_limit_counts_from_each_start_except_while_it_is_paused() -> None:
    texts: list[str] = []
    limit = ErrorLimit(2, 10.0, texts.append, lambda: True)
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


TEXT = """
system: changing
nodes:
  source:
    behavior: changing:Source
    publishers: {numbers: {type: std_msgs/msg/Int64}, texts: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 20}, tock: {period_ms: 20}}
  forger: {behavior: changing:Forger, subscriptions: {numbers: {type: std_msgs/msg/Int64}}}
  reader:
    behavior: changing:Reader
    subscriptions: {numbers: {type: std_msgs/msg/Int64}, texts: {type: std_msgs/msg/String}}
"""
MODULE = """
from composer.behavior import Behavior
from std_msgs.msg import Int64, String

class Source(Behavior):
    def on_configure(self):
        self.text = String()

    def on_tick(self):
        self.publishers.numbers.publish(Int64(data=1))

    def on_tock(self):
        self.text.data += "x"  # published before
        self.publishers.texts.publish(self.text)

class Forger(Behavior):
    async def on_numbers(self, message):
        await self.clock.sleep(0.001)
        message.data = 2

class Reader(Behavior):
    def on_configure(self):
        self.received = 0

    def on_numbers(self, message):
        self.received += 1

    def on_texts(self, message):
        self.received += 1
"""
FORGERY = "subscription 'numbers': modified a message (Int64) after it was received by 'numbers'"
USED_AGAIN = "timer 'tock': modified a message (String) after it was published by 'texts'"


@pytest.mark.parametrize("checks", [True, False])
def test_callbacks_that_change_a_message_are_named_if_it_is_checked(
    tmp_path: Path, checks: bool
) -> None:
    options = HostOptions(check_mutation=checks)
    with running(TEXT, tmp_path, options=options, changing=MODULE) as system:
        for line in (FORGERY, USED_AGAIN) if checks else ():
            system.wait_for_log(line)
        reader = system.behavior("reader")
        wait_until(lambda: reader.received > 10)
        faulty = {entry.node for entry in system.stop().nodes if entry.errors}
    assert faulty == ({"/forger", "/source"} if checks else set())
    named = [line for line in system.log() if "modified a message" in line]
    assert bool(named) is checks
    assert all(line.startswith((FORGERY, USED_AGAIN)) for line in named)


def test_the_option_of_the_command_line(tmp_path: Path) -> None:
    path = write_system(tmp_path, TEXT, changing=MODULE)
    with InAProcess(str(path), "--check-mutation") as system:
        line = system.wait_for(re.escape(FORGERY))
        assert "[ERROR] [forger]" in line
        system.wait_for(re.escape(USED_AGAIN))
        code, _ = system.stop()
    assert code == 0
    assert "[reader]" not in system.output


HOSTILE = """
system: hostile
executors: {default: {kind: KIND}}
nodes:
  hostile:
    behavior: hostile:Hostile
    services:
      ask: {type: std_srvs/srv/Trigger, external: true}
      ask_later: {type: std_srvs/srv/Trigger, external: true}
    action_servers: {drive: {type: composer_interfaces/action/Navigate, external: true}}
    timers: {tick: {period_ms: 2}, later: {period_ms: 2}}
"""
HOSTILE_MODULE = """
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
    with running(HOSTILE.replace("KIND", kind), tmp_path, hostile=HOSTILE_MODULE) as system:
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
