"""Many bring-ups with a flaky driver on busy processors, and a long wait for an external node."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from composer.runtime.supervision.events import BroughtUp, NodeFailed, Restarted, StateChanged
from tests.ros.supervision.test_external_transitions import busy_processors
from tests.ros.support.in_process import running, wait_until

DRIVER = Path(__file__).parents[1] / "programs" / "driver.py"
FLAKY = f"""
tries=$(cat tries)
echo $((tries + 1)) > tries
[ "$tries" -ge "$(cat fails)" ] || exit 1
exec {sys.executable} {DRIVER} "$@"
"""
ROBOT = """
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
            with running(ROBOT, tmp_path) as system:
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
