"""Failed nodes are restarted, isolated, or end the system; only user code is interrupted."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from std_msgs.msg import String

from composer.model import PrimaryState
from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import (
    BroughtUp,
    NodeFailed,
    Restarted,
    StateChanged,
    Stuck,
)
from composer.runtime.supervision.health_monitor import CheckTime
from tests.ros.support.faulty_system import HANGING, write_faulty_system
from tests.ros.support.in_process import Peer, RunningSystem, running, system_of, wait_until

ROBOT = """
system: robot
lifecycle: {on_failure: POLICY, restart: {BUDGET}}
executors: {own: {kind: KIND}}
nodes:
  motor: {lifecycle: {depends_on: [planner]}}
  planner: {lifecycle: {depends_on: [sensor]}}
  sensor:
    executor: own
    behavior: sensor:Sensor
    parameters: {fault: ""}
    publishers: {scan: {type: std_msgs/msg/String, external: true}}
    timers: {tick: {period_ms: 10}}
    lifecycle: {watch: {WATCH}, timeout_ms: 2500}
  camera:
    publishers: {image: {type: std_msgs/msg/String, external: true}}
    timers: {tick: {period_ms: 10, publish: {image: {data: picture}}}}
"""
SENSOR = """
import time
from composer.behavior import Behavior

LIVES = []

class Sensor(Behavior):
    def on_configure(self):
        LIVES.append(self)
        self.life = len(LIVES)
        if self.parameters.fault == "configure" and self.life == 2:
            raise ValueError("no device")

    def on_deactivate(self):
        if self.parameters.fault == "deactivate":
            raise ValueError("stuck motor")

    def on_tick(self):
        fault = self.parameters.fault
        if self.life > 1 and not fault.startswith("always"):
            fault = ""
        if fault == "raise":
            raise ValueError("bad data")
        if fault == "loop":
            while True: time.sleep(0.001)  # one line, so that the stack always contains it
        if fault == "block":
            time.sleep(4.0)
        if "silent" not in fault:
            self.publishers.scan.publish(self.publishers.scan.message_type(data=str(self.life)))
"""


#: What is watched for each fault: on a busy machine, another limit might be exceeded first.
WATCH = {"silent": "topic_silence_ms: 300", "loop": "callback_ms: 200", "raise": "max_errors: 2"}


def robot(
    fault: str, policy: str = "restart", budget: str = "backoff_ms: 20", kind: str = "events"
) -> str:
    text = ROBOT.replace("POLICY", policy).replace("BUDGET", budget)
    return text.replace("KIND", kind).replace("WATCH", WATCH.get(fault, ""))


def since(system: RunningSystem, failed: NodeFailed) -> list[str]:
    """Return the state changes since a failure."""
    changes = system.reported(StateChanged)
    return [str(event) for event in changes if event.elapsed_s >= failed.elapsed_s]


RESTART_CHANGES = [
    "/motor inactive",
    "/planner inactive",
    "/sensor inactive",
    "/sensor unconfigured",
    "/sensor inactive",
    "/sensor active",
    "/planner active",
    "/motor active",
]


@pytest.mark.parametrize(
    ("fault", "reason", "kind"),
    [
        ("silent", "silent for 300 ms", "events"),
        ("loop", "on_tick took longer than 200 ms", "events"),
        ("loop", "on_tick took longer than 200 ms", "multi_threaded"),
        ("raise", "more than 2 errors within 60 s", "multi_threaded"),
    ],
)
def test_a_failed_node_is_restarted_while_its_dependents_wait(
    tmp_path: Path, peer: Peer, fault: str, reason: str, kind: str
) -> None:
    with running(robot(fault, kind=kind), tmp_path, sensor=SENSOR) as system:
        images = peer.listen(String, "/image")
        scans = peer.listen(String, "/scan")
        assert peer.set_parameter("/sensor", "fault", fault) == ""
        wait_until(lambda: system.reported(Restarted), "the restart")
        assert len(system.reported(NodeFailed)) == 1
        failed = system.reported(NodeFailed)[0]
        assert (failed.nodes, failed.reason) == (("/sensor",), reason)
        assert failed.consequence == "restart 1 in 0.02 s"
        assert since(system, failed) == RESTART_CHANGES
        wait_until(lambda: scans and scans[-1].data == "2", "messages of the new behavior")
        seen = len(images)
        wait_until(lambda: len(images) > seen, "more images")
        if fault == "loop":
            stuck = system.reported(Stuck)[0]
            assert "return from on_tick within 200 ms" in str(stuck)
            assert "time.sleep(0.001)" in stuck.stack
        assert system.stop().exit_code == 0, "a successful restart"
    assert "restart" not in "".join(system.states("/camera"))


def test_a_failed_restart_is_retried(tmp_path: Path, peer: Peer) -> None:
    module = SENSOR.replace('if fault == "raise"', 'if fault == "configure" and self.life == 1')
    with running(robot("raise", budget="backoff_ms: 50"), tmp_path, sensor=module) as system:
        assert peer.set_parameter("/sensor", "fault", "configure") == ""
        wait_until(lambda: system.reported(Restarted), "the restart")
        failures = system.reported(NodeFailed)
        assert [event.consequence for event in failures] == [
            "restart 1 in 0.05 s",
            "restart 2 in 0.1 s",
        ]
        assert failures[1].reason == "configure failed: ValueError: no device"
        assert since(system, failures[1])[-4:] == RESTART_CHANGES[-4:]
        assert system.stop().exit_code == 0


def test_too_many_restarts_end_the_system_in_order(tmp_path: Path, peer: Peer) -> None:
    """After five restarts within the window, the system shuts down and reports the reason."""
    budget = "max_attempts: 5, window_ms: 60000, backoff_ms: 1, then: shutdown"
    with running(robot("silent", budget=budget), tmp_path, sensor=SENSOR) as system:
        assert peer.set_parameter("/sensor", "fault", "always silent") == ""
        outcome = system.end()
    failures = system.reported(NodeFailed)
    assert [event.consequence.partition(" in")[0] for event in failures] == [
        *(f"restart {attempt}" for attempt in range(1, 6)),
        "shutting down the system",
    ]
    assert len(system.reported(Restarted)) == 5
    assert outcome.exit_code == 1
    assert outcome.reason == (
        "/sensor failed: silent for 300 ms; restarted 5 times within 60 s before"
    )
    assert since(system, failures[0])[:8] == RESTART_CHANGES
    assert [node.state for node in outcome.nodes] == ["finalized"] * 4
    last = since(system, failures[-1])
    assert last.index("/motor inactive") < last.index("/planner inactive")
    assert last.index("/planner inactive") < last.index("/sensor inactive")


@pytest.mark.parametrize("fault", ["loop", "deactivate"])
def test_a_failed_node_is_isolated_and_the_others_continue(
    tmp_path: Path, peer: Peer, fault: str
) -> None:
    with running(robot(fault, "isolate"), tmp_path, sensor=SENSOR) as system:
        images = peer.listen(String, "/image")
        assert peer.set_parameter("/sensor", "fault", fault) == ""
        if fault == "deactivate":
            assert not peer.change("/sensor", "deactivate")
        wait_until(lambda: peer.state("/motor") == "inactive", "the inactive dependent")
        wait_until(lambda: peer.state("/sensor") == "unconfigured", "the failed node is down")
        # If the transition itself failed, this comes later.
        wait_until(lambda: peer.state("/planner") == "inactive", "the other dependent")
        seen = len(images)
        wait_until(lambda: len(images) > seen, "more images")
        failed = system.reported(NodeFailed)[0]
        assert failed.consequence == "isolating it"
        if fault == "deactivate":
            assert failed.reason == "deactivate ended in an error: ValueError: stuck motor"

        # After requested transitions, its dependents become active again.
        assert peer.set_parameter("/sensor", "fault", "") == ""
        assert peer.change("/sensor", "configure")
        assert peer.state("/motor") == "inactive"
        assert peer.change("/sensor", "activate")
        wait_until(lambda: peer.state("/motor") == "active", "the active dependent")
        assert peer.state("/planner") == "active"
        assert system.stop().exit_code == 0


def test_an_executor_that_cannot_be_interrupted_is_abandoned_until_it_returns(
    tmp_path: Path, peer: Peer
) -> None:
    text = robot("loop", "isolate").replace("  camera:\n", "  camera:\n    executor: own\n")
    with running(text, tmp_path, sensor=SENSOR) as system:
        assert peer.set_parameter("/sensor", "fault", "block") == ""
        wait_until(lambda: system.reported(NodeFailed), "the failure")
        assert system.reported(NodeFailed)[0].reason == "on_tick does not return"
        wait_until(lambda: "/motor inactive" in system.states(), "the inactive dependent")
        wait_until(lambda: "/sensor unconfigured" in system.states(), "the end of the callback")
        assert peer.state("/camera") == "active"
        assert peer.state("/planner") == "inactive"
        assert len(system.reported(NodeFailed)) == 1
        assert system.stop().exit_code == 1


def test_a_stop_does_not_wait_for_a_restart(tmp_path: Path, peer: Peer) -> None:
    with running(robot("silent", budget="backoff_ms: 600000"), tmp_path, sensor=SENSOR) as system:
        assert peer.set_parameter("/sensor", "fault", "silent") == ""
        wait_until(lambda: "/sensor unconfigured" in system.states())
        assert system.stop().exit_code == 1


@pytest.mark.parametrize(
    ("passed_s", "counted_s"), [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (2.5, 2.0), (3600.0, 2.0)]
)
def test_a_late_check_counts_at_most_as_two(passed_s: float, counted_s: float) -> None:
    """Otherwise every callback would hang after a pause of the computer."""
    time = CheckTime(period_s=1.0, now_s=10.0)
    began_s = time.advance(11.0)
    assert time.advance(11.0 + passed_s) - began_s == pytest.approx(counted_s)
    assert time.advance(12.0 + passed_s) - began_s == pytest.approx(counted_s + 1.0)


CHATTER = """
system: chat
lifecycle: {on_failure: isolate}
executors: {own: {kind: KIND}}
nodes:
  chatter:
    executor: own
    behavior: chatter:Chatter
    parameters: {fault: ""}
    publishers: {chat: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 10}}
    lifecycle: {watch: {callback_ms: 200}}
  relay:
    executor: own
    subscriptions:
      chat: {type: std_msgs/msg/String, external: true, publish: {echo: {data: "{message.data}"}}}
    publishers: {echo: {type: std_msgs/msg/String, external: true}}
"""
MODULE = """
from composer.behavior import Behavior

class Chatter(Behavior):
    def on_tick(self):
        message = self.publishers.chat.message_type(data="on and on")
        while self.parameters.fault:
            self.publishers.chat.publish(message)

    def on_deactivate(self):
        self.publishers.chat.publish(self.publishers.chat.message_type(data="a last word"))
"""


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_an_interrupt_is_raised_in_the_user_code_that_calls_the_composer(
    tmp_path: Path, peer: Peer, kind: str
) -> None:
    """The publisher in the endless loop delivers to another node within the call."""
    with running(CHATTER.replace("KIND", kind), tmp_path, chatter=MODULE) as system:
        echo = peer.listen(String, "/echo")
        chat = peer.publisher(String, "/chat")
        assert peer.set_parameter("/chatter", "fault", "yes") == ""
        wait_until(lambda: system.reported(NodeFailed), "the failure")
        assert system.reported(NodeFailed)[0].reason == "on_tick took longer than 200 ms"
        assert "return from on_tick within 200 ms" in str(system.reported(Stuck)[0])
        traceback = system.wait_for_log("CallbackInterrupted")
        frames = re.findall(r'File ".*?([^/"]+)", line \d+, in (\w+)', system.log_text())
        # Lookups of publishers and parameters have no side effects and may be interrupted.
        where = [frame for frame in frames if frame[1] != "__getattr__"]
        assert where[-1] == ("chatter.py", "on_tick"), traceback
        wait_until(lambda: echo and echo[-1].data == "a last word", "the message of on_deactivate")
        # The other node of the executor still receives messages.
        chat.publish(String(data="your turn"))
        wait_until(lambda: echo[-1].data == "your turn", "the relay still works")


NESTED = """
system: nested
lifecycle: {on_failure: isolate}
executors: {own: {kind: events}}
nodes:
  caller:
    executor: own
    behavior: nested:Caller
    publishers: {chat: {type: std_msgs/msg/String}}
    timers: {tick: {period_ms: 20}}
    lifecycle: {watch: {callback_ms: 500}}
  relay:
    executor: own
    subscriptions: {chat: {type: std_msgs/msg/String, publish: {passed: {data: "{message.data}"}}}}
    publishers: {passed: {type: std_msgs/msg/String}}
    lifecycle: {watch: {callback_ms: 500}}
  hanging:
    executor: own
    behavior: nested:Hanging
    subscriptions: {passed: {type: std_msgs/msg/String}}
    lifecycle: {watch: {callback_ms: 1000}}
"""
CALLER_AND_HANGING = """
from composer.behavior import Behavior

class Caller(Behavior):
    def on_tick(self):
        self.publishers.chat.publish(self.publishers.chat.message_type(data="go"))

class Hanging(Behavior):
    def on_passed(self, message):
        while True:
            pass
"""


def test_callbacks_that_wait_for_a_hanging_callback_are_not_interrupted(tmp_path: Path) -> None:
    """It runs within a reaction within a callback, which have half of its time limit."""
    with running(NESTED, tmp_path, nested=CALLER_AND_HANGING) as system:
        wait_until(lambda: "/hanging unconfigured" in system.states(), "the isolation")
        failed = [(*event.nodes, event.reason) for event in system.reported(NodeFailed)]
        assert failed == [("/hanging", "on_passed took longer than 1000 ms")]
        assert system.states("/caller")[-1] == "/caller active"
        assert system.states("/relay")[-1] == "/relay active"


def test_nodes_on_many_threads_come_up_with_frequent_thread_switches(tmp_path: Path) -> None:
    """Threads switch so often that all interleavings happen."""
    text = write_faulty_system(tmp_path, HANGING).read_text(encoding="utf-8")
    patient = text.replace("_ms: 300", "_ms: 20000").replace("_ms: 2500", "_ms: 20000")
    usual_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    options = HostOptions(stop_within_s=60.0)
    system = RunningSystem(system_of(patient, tmp_path), options, PrimaryState.ACTIVE)
    try:
        # On a busy machine, each switch of threads may have to wait for a processor.
        wait_until(lambda: system.reported(BroughtUp) or system.has_ended(), "bring-up", 150.0)
        (up,) = system.reported(BroughtUp)
        assert (up.active, up.remarks) == (1 + len(HANGING), ())
    finally:
        sys.setswitchinterval(usual_s)
        outcome = system.stop()
    assert outcome.exit_code == 0
    assert not any(node.errors for node in outcome.nodes)
