"""The policies of nodes during bring-up, nodes that fail themselves, and all or nothing."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import (
    BroughtUp,
    NodeFailed,
    NodeTransitionFailed,
    Restarted,
    RolledBack,
    StateChanged,
)
from tests.ros.supervision.test_external_transitions import busy_processors
from tests.ros.support.in_process import running, wait_until

ROBOT = """
system: robot
lifecycle: {restart: {max_attempts: 2, backoff_ms: 20}}
nodes:
  base: {}
  user: {lifecycle: {depends_on: [driver]}}
  driver:
    behavior: driver:Driver
    required: REQUIRED
    parameters: {fails: FAILS}
    lifecycle: {on_failure: POLICY}
"""
DRIVER = """
from composer.behavior import Behavior

TRIES = []

class Driver(Behavior):
    def on_activate(self):
        TRIES.append(self)
        if len(TRIES) <= self.parameters.fails:
            raise OSError("usb device not ready")
"""
NOT_READY = "activate failed: OSError: usb device not ready"


def robot(policy: str, fails: int = 99, required: str = "true") -> str:
    text = ROBOT.replace("POLICY", policy).replace("FAILS", str(fails))
    return text.replace("REQUIRED", required)


def test_a_driver_that_fails_its_first_starts_is_restarted(tmp_path: Path) -> None:
    with running(robot("restart", fails=2), tmp_path, driver=DRIVER) as system:
        texts = list(map(str, system.events))
        (up,) = system.reported(BroughtUp)
        assert (up.active, up.is_complete, up.remarks) == (3, True, ())
        failed = [f"/driver failed: {NOT_READY}; restart {n}" for n in (1, 2)]
        order = ["/base active", failed[0], failed[1], "/driver active", "/user active", str(up)]
        found = [next(n for n, text in enumerate(texts) if part in text) for part in order]
        assert found == sorted(found), texts
        assert system.reported(Restarted)[0].attempt == 2
        assert not system.reported(NodeTransitionFailed), "each failure is reported once"
        assert system.stop().exit_code == 0


@pytest.mark.parametrize(
    ("policy", "required", "together", "remark"),
    [
        ("isolate", True, False, f"/driver is isolated: {NOT_READY}"),
        ("restart", True, False, f"/driver is given up: {NOT_READY}"),
        ("restart", False, False, f"/driver is given up: {NOT_READY}"),
        ("shutdown", False, True, f"/driver is isolated: {NOT_READY}"),
    ],
)
def test_a_node_that_does_not_come_up_stops_only_those_that_depend_on_it(
    tmp_path: Path, policy: str, required: bool, together: bool, remark: str
) -> None:
    """All or nothing is not about a node that is not required."""
    text = robot(policy, required=str(required).lower())
    options = HostOptions(all_or_nothing=together, stop_within_s=20.0)
    with running(text, tmp_path, options=options, driver=DRIVER) as system:
        (up,) = system.reported(BroughtUp)
        assert up.is_complete is not required
        assert NOT_READY not in str(up), "the log has the reason already"
        wait_until(lambda: system.node("driver").state == "unconfigured", "the end of restarts")
        restarts = 2 if policy == "restart" else 0
        wait_until(lambda: len(system.reported(NodeFailed)) == restarts + 1, "the last failure")
        assert [system.node(name).state for name in ("base", "user")] == ["active", "inactive"]
        outcome = system.stop()
    assert (outcome.exit_code, outcome.remarks) == (int(required), (remark,))


def test_nodes_start_without_one_whose_failure_is_ignored(tmp_path: Path) -> None:
    with running(robot("ignore"), tmp_path, driver=DRIVER) as system:
        assert system.reported(BroughtUp)[0].active == 2
        (failed,) = system.reported(NodeFailed)
        assert (failed.consequence, failed.is_tolerated) == ("ignoring it", True)
        assert system.node("user").state == "active"
        assert system.stop().exit_code == 0


@pytest.mark.parametrize(
    "policy", ["shutdown", "restart, restart: {max_attempts: 1, then: shutdown}"]
)
def test_a_bring_up_is_rolled_back(tmp_path: Path, policy: str) -> None:
    with running(robot(policy), tmp_path, driver=DRIVER) as system:
        outcome = system.end()
    assert outcome.exit_code == 1
    assert outcome.reason.startswith("/driver failed")
    assert "/base" in system.reported(RolledBack)[0].nodes
    assert not system.reported(BroughtUp)
    assert {node.state for node in outcome.nodes} == {"finalized"}


FAILING = """
system: robot
lifecycle: {on_failure: restart, restart: {backoff_ms: 20}}
nodes:
  in_${where}:
    for_each: {where: [configure, activate, tick]}
    behavior: driver:Driver
    parameters: {fails_in: "${where}"}
    timers: {tick: {period_ms: 20}}
  of_class: {class: driver:Class}
"""
FAILING_DRIVER = """
from collections import Counter
from composer.behavior import Behavior
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn

LIVES = Counter()

class Driver(Behavior):
    def on_configure(self):
        LIVES[self.name] += 1
        self.check("configure")

    def on_activate(self):
        self.check("activate")

    def on_tick(self):
        self.check("tick")

    def check(self, where):
        if LIVES[self.name] == 1 and self.parameters.fails_in == where:
            self.fail("lost the device")

class Class(LifecycleNode):
    def __init__(self):
        super().__init__("driver")
        LIVES["class"] += 1

    def on_activate(self, state):
        if LIVES["class"] == 1:
            return TransitionCallbackReturn.ERROR
        return super().on_activate(state)

    def on_error(self, state):
        self.get_logger().info("handles the error")
        return TransitionCallbackReturn.SUCCESS
"""


def test_behaviors_and_classes_can_fail_their_nodes(tmp_path: Path) -> None:
    reasons = {
        "/in_configure": "configure failed: Failed: lost the device",
        "/in_activate": "activate failed: Failed: lost the device",
        "/in_tick": "lost the device",
        "/of_class": "activate failed: Failed: on_activate returned ERROR",
    }
    with running(FAILING, tmp_path, driver=FAILING_DRIVER) as system:
        wait_until(lambda: len(system.reported(Restarted)) == len(reasons), "the restarts")
        failures = system.reported(NodeFailed)
        assert {event.nodes[0] for event in failures} == reasons.keys()
        assert all(event.reason.startswith(reasons[event.nodes[0]]) for event in failures)
        assert [event.consequence for event in failures] == ["restart 1 in 0.02 s"] * len(reasons)
        system.wait_for_log("handles the error")
        outcome = system.stop()
    assert outcome.exit_code == 0
    for name in reasons:
        assert f"{name} active" in system.states(name)[-4:]


DRIVER_PROGRAM = Path(__file__).parents[1] / "programs" / "driver.py"
FLAKY = f"""
tries=$(cat tries)
echo $((tries + 1)) > tries
[ "$tries" -ge "$(cat fails)" ] || exit 1
exec {sys.executable} {DRIVER_PROGRAM} "$@"
"""
FLAKY_ROBOT = """
system: robot
lifecycle: {on_failure: restart, restart: {max_attempts: 5, backoff_ms: 50}}
nodes:
  user: {lifecycle: {depends_on: [driver]}}
  driver:
    executable: {command: [sh, flaky.sh], ready_timeout_ms: 30000}
    publishers: {words: {type: std_msgs/msg/String, external: true}}
  base: {timers: {tick: {period_ms: 50}}}
  camera: {lifecycle: {depends_on: [base]}}
"""


@pytest.mark.parametrize(
    "rounds", [1, pytest.param(100, marks=[pytest.mark.soak, pytest.mark.timeout(1800)])]
)
def test_a_flaky_driver_comes_up_after_the_nodes_that_do_not_need_it(
    rounds: int, tmp_path: Path
) -> None:
    (tmp_path / "flaky.sh").write_text(FLAKY, encoding="utf-8")
    with busy_processors(1):
        for number in range(rounds):
            fails = number % 3 + 1
            (tmp_path / "tries").write_text("0", encoding="utf-8")
            (tmp_path / "fails").write_text(str(fails), encoding="utf-8")
            with running(FLAKY_ROBOT, tmp_path) as system:
                (up,) = system.reported(BroughtUp)
                assert (up.active, up.is_complete, up.remarks) == (4, True, ())
                active = [e.node for e in system.reported(StateChanged) if e.state == "active"]
                assert active == ["/base", "/camera", "/driver", "/user"], number
                failed = system.reported(NodeFailed)
                assert {event.nodes for event in failed} == {("/driver",)}
                assert [event.consequence.split()[1] for event in failed] == [
                    str(attempt) for attempt in range(1, fails + 1)
                ]
                assert [event.attempt for event in system.reported(Restarted)] == [fails]
                assert system.stop().exit_code == 0, number


WAITING = """
system: robot
nodes:
  base: {timers: {tick: {period_ms: 100}}}
  operator:
    external: {ready_timeout_ms: 2000}
    required: false
    publishers: {estop: {type: std_msgs/msg/Bool, qos: command, external: true}}
  stop: {lifecycle: {depends_on: [operator]}}
"""


@pytest.mark.parametrize(
    "wait_s", [3.0, pytest.param(60.0, marks=[pytest.mark.soak, pytest.mark.timeout(300)])]
)
def test_nothing_waits_for_a_missing_node_that_is_not_required(
    wait_s: float, tmp_path: Path
) -> None:
    with running(WAITING, tmp_path) as system:
        (up,) = system.reported(BroughtUp)
        assert str(up).endswith(" s, waiting for /operator")
        (tick,) = system.node("base").statistics.callbacks.values()
        before, used_s, end_s = tick.times.count, time.process_time(), time.monotonic() + wait_s
        wait_until(lambda: time.monotonic() > end_s, "the time", limit_s=wait_s + 60.0)
        assert tick.times.count - before >= wait_s  # a tenth
        assert time.process_time() - used_s < 0.5 * wait_s
        (failed,) = system.reported(NodeFailed)  # once
        assert failed.is_tolerated
        assert [system.node(name).state for name in ("base", "stop")] == ["active", "inactive"]
        outcome = system.stop()
    assert (outcome.exit_code, outcome.remarks) == (0, ("waiting for /operator",))
