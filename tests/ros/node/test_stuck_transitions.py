"""Transitions that hang forever, on every kind of executor."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from textwrap import dedent

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_srvs.srv import Trigger

from tests.ros.support.in_process import Peer, finished, wait_until
from tests.ros.support.system_process import RunningSystem

FAILURES = {
    "events": "on_activate does not return",
    "single_threaded": "on_activate does not return",
    # Another thread ends the transition, although the handler never returns.
    "multi_threaded": "activate ended in an error: TransitionTimeout: timed out after 1 s",
}
KINDS = tuple(FAILURES)
SYSTEM = """
system: robot
executors: {events: {kind: events}, single_threaded: {kind: single_threaded},
  multi_threaded: {kind: multi_threaded}}
nodes:
  other:
    services: {alive: {type: std_srvs/srv/Trigger, external: true, respond: {success: true}}}
"""
NODE = """
  KIND:
    executor: KIND
    behavior: stuck:Stuck
    lifecycle: {timeout_ms: 1000, autostart: inactive}
"""
MODULE = """
import time
from composer.behavior import Behavior


class Stuck(Behavior):
    def on_activate(self):
        time.sleep(60.0)  # in C, which Python cannot interrupt
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "robot.yaml"
    nodes = "".join(NODE.replace("KIND", kind) for kind in KINDS)
    file.write_text(SYSTEM + nodes, encoding="utf-8")
    file.with_name("stuck.py").write_text(dedent(MODULE), encoding="utf-8")
    return file


def test_a_request_is_answered_and_other_nodes_continue(path: Path, peer: Peer) -> None:
    request = ChangeState.Request(transition=Transition(label="activate"))
    with RunningSystem(str(path)) as system:
        system.wait_for("1 of 4 nodes active")
        clients = [peer.client(ChangeState, f"/{kind}/change_state") for kind in KINDS]
        answers = [client.call_async(request) for client in clients]
        for kind in KINDS:
            system.wait_for(rf"/{kind} is stuck and did not return from on_activate within 3000 ms")
            system.wait_for(rf"/{kind}(, /\w+)* failed: {FAILURES[kind]}; isolating it")
        assert not any(finished(answer).success for answer in answers)
        wait_until(lambda: system.output.count("time.sleep(60.0)") >= 3, "the stacks")
        assert peer.call(Trigger, "/alive").success
        down = "/events is isolated: on_activate does not return"
        # The response and the report of the failure come before its handling.
        wait_until(lambda: down in peer.call(Trigger, "/robot/manager/is_active").message, down)

        code, _ = system.stop(signal.SIGTERM)  # waits less than the transitions would take
    assert code == 1
    assert "/other finalized" in system.output
    assert "never awaited" not in system.output
    for kind in KINDS:
        state = "finalized" if kind == "multi_threaded" else "activating"
        assert re.search(rf"^/{kind} +{state} ", system.output, re.MULTILINE), kind


def test_a_transition_that_waits_for_a_busy_executor_is_not_stuck(tmp_path: Path) -> None:
    """Each takes a part of its time limit; the last one waits longer than its limit."""
    path = tmp_path / "slow.yaml"
    nodes = "".join(f"  n{number}: {{behavior: slow:Slow}}\n" for number in range(12))
    path.write_text(f"system: slow\nlifecycle: {{timeout_ms: 3000}}\nnodes:\n{nodes}", "utf-8")
    slow = """
    import time

    class Slow:
        def on_configure(self):
            time.sleep(0.3)  # a tenth of its limit
    """
    path.with_suffix(".py").write_text(dedent(slow), encoding="utf-8")
    with RunningSystem(str(path)) as system:
        system.wait_for("12 of 12 nodes active")
        assert system.stop()[0] == 0
