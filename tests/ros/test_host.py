"""The bring-up of a system is all or nothing; the tear-down is ordered and limited in time."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from composer.runtime.host_options import HostOptions
from composer.runtime.supervision.events import (
    BroughtUp,
    NodeTransitionFailed,
    RollingBack,
    Stopping,
    Stuck,
)
from tests.ros.support.in_process import (
    Peer,
    RunningSystem,
    end_limit_s,
    running,
    system_of,
    wait_until,
)

CHAIN = """
system: chain
nodes:
  motor: {namespace: control, lifecycle: {depends_on: [planner]}}
  planner: {namespace: planning, lifecycle: {depends_on: [sensor]}, behavior: planner:Planner}
  sensor: {}
"""
WELL = """
from composer.behavior import Behavior

class Planner(Behavior):
    pass
"""


TOGETHER = HostOptions(all_or_nothing=True)


def test_up_in_dependency_order_and_down_in_reverse(tmp_path: Path, peer: Peer) -> None:
    with running(CHAIN, tmp_path, planner=WELL) as system:
        assert peer.state("/control/motor") == "active"
        outcome = system.stop()
    nodes = ["/sensor", "/planning/planner", "/control/motor"]
    up = [f"{node} {state}" for state in ("inactive", "active") for node in nodes]
    down = [
        f"{node} {state}"
        for state in ("inactive", "unconfigured", "finalized")
        for node in reversed(nodes)
    ]
    assert system.states() == up + down
    assert (outcome.exit_code, outcome.reason, outcome.hung) == (0, "the test is over", False)
    assert [node.state for node in outcome.nodes] == ["finalized"] * 3


@pytest.mark.parametrize(
    ("handler", "body", "reason"),
    [
        ("on_configure", "raise ValueError('no map')", "ValueError: no map"),
        ("on_activate", "raise TransitionFailed('no odometry')", "no odometry"),
        ("on_activate", "return False", "on_activate returned False"),
        ("__init__", "raise ValueError('no licence')", "ValueError: no licence"),
    ],
)
def test_a_failing_bring_up_is_rolled_back_in_reverse(
    tmp_path: Path, handler: str, body: str, reason: str
) -> None:
    module = f"""
    from composer.behavior import Behavior, TransitionFailed

    class Planner(Behavior):
        def {handler}(self):
            {body}
    """
    system = RunningSystem(system_of(CHAIN, tmp_path, planner=module), TOGETHER, None)
    outcome = system.end()
    transition = "configure" if handler == "__init__" else handler.removeprefix("on_")
    assert outcome.exit_code == 1
    assert outcome.reason == "/planning/planner failed"
    assert [(event.node, event.reason) for event in system.reported(RollingBack)] == [
        ("/planning/planner", f"{transition} failed: {reason}")
    ]
    assert not system.reported(BroughtUp)
    rolled_back = system.states()[system.states().index("/sensor finalized") - 2 :]
    assert rolled_back == [
        f"{n} finalized" for n in ("/control/motor", "/planning/planner", "/sensor")
    ]
    if transition == "activate":
        assert "/control/motor active" not in system.states()
        assert "/sensor active" in system.states()


def test_a_system_stops_after_its_run_time(tmp_path: Path) -> None:
    limits: list[float | None] = []
    options = HostOptions(
        run_for_s=0.3, bring_up_within_s=30.0, stop_within_s=20.0, end_within=limits.append
    )
    system = RunningSystem(system_of(CHAIN, tmp_path, planner=WELL), options, None)
    outcome = system.end()
    assert (outcome.exit_code, outcome.reason) == (0, "--for elapsed")
    up, stopping = system.reported(BroughtUp)[0], system.reported(Stopping)[0]
    assert stopping.elapsed_s - up.elapsed_s >= 0.3
    # The start, with a limit for each node; the bring-up and the run, if they hang; the end.
    assert limits == [10.0, 10.0, 10.0, 10.0, 150.0, 60.3, 10.0]


HANG = """
from time import sleep
from composer.behavior import Behavior

class Planner(Behavior):
    def {handler}(self):
        self.log.info("hanging")
        sleep(6.0)
"""
HANGING = """
system: hanging
executors: {own: {kind: KIND}}
nodes:
  planner: {executor: own, behavior: planner:Planner, timers: {tick: {period_ms: 10}}}
  sensor: {services: {trigger: {type: std_srvs/srv/Trigger, external: true}}}
"""


@pytest.mark.parametrize("kind", ["events", "multi_threaded"])
def test_a_hanging_callback_does_not_delay_the_end(tmp_path: Path, peer: Peer, kind: str) -> None:
    text = HANGING.replace("KIND", kind)
    module = HANG.format(handler="on_tick")
    options = HostOptions(stop_within_s=3.0)
    with running(text, tmp_path, options=options, planner=module) as system:
        system.wait_for_log("hanging")
        peer.call(Trigger, "/trigger")  # the other executor still works
        began_s = time.monotonic()
        outcome = system.stop()
        took_s = time.monotonic() - began_s
    assert took_s < end_limit_s()
    assert (outcome.exit_code, outcome.hung) == (1, True)
    stuck = system.reported(Stuck)[0]
    assert (stuck.node, stuck.action) == ("/planner", "deactivate")
    assert "in on_tick" in stuck.stack
    assert "sleep(6.0)" in stuck.stack
    assert {node.node: node.state for node in outcome.nodes}["/sensor"] == "finalized"


def test_a_stuck_node_is_reported_before_it_continues(tmp_path: Path) -> None:
    module = HANG.format(handler="on_deactivate").replace("sleep(6.0)", "while True: sleep(0.01)")
    options = HostOptions(stop_within_s=4.0)
    text = HANGING.replace("KIND", "events")
    with running(text, tmp_path, options=options, planner=module) as system:
        outcome = system.stop()
    assert (outcome.exit_code, outcome.hung) == (1, False)
    (stuck,) = system.reported(Stuck)
    assert str(stuck).startswith("/planner is stuck and did not deactivate in\n")
    assert "composer/runtime" not in stuck.stack, "only user code"
    changes = system.states("/planner")
    assert changes[2:] == ["/planner unconfigured", "/planner finalized"]
    texts = list(map(str, system.events))
    assert system.events.index(stuck) < texts.index(changes[2])


def test_a_hanging_transition_fails_the_bring_up(tmp_path: Path) -> None:
    text = HANGING.replace("KIND", "events")
    module = HANG.format(handler="on_configure")
    options = replace(TOGETHER, transition_timeout_s=1.0)
    system = RunningSystem(system_of(text, tmp_path, planner=module), options, None)
    outcome = system.end()
    assert (outcome.exit_code, outcome.hung) == (1, True)
    assert "in on_configure" in system.reported(Stuck)[0].stack
    assert system.reported(RollingBack)[0].reason == "configure failed: stuck"
    assert "/sensor finalized" in system.states()


@pytest.mark.parametrize("urgent", [False, True])
def test_a_slow_asynchronous_handler_is_canceled(tmp_path: Path, urgent: bool) -> None:
    module = """
    from composer.behavior import Behavior

    class Planner(Behavior):
        async def on_deactivate(self):
            self.log.info("slow")
            await self.clock.sleep(60.0)
    """
    # Without the second request, the handler gets more than half of that time.
    options = HostOptions(stop_within_s=40.0 if urgent else 4.0)
    with running(CHAIN, tmp_path, options=options, planner=module) as system:
        system.host.stop("first")
        stopped_s = time.monotonic()
        system.wait_for_log("slow")
        if urgent:
            wait_until(lambda: time.monotonic() > stopped_s + 0.15, "the time that a user takes")
            system.host.stop("second")
        outcome = system.end()
        took_s = time.monotonic() - stopped_s
    assert took_s < 20.0
    assert outcome.exit_code == 1
    assert not outcome.hung, [str(event) for event in system.events]
    assert system.reported(Stuck)[0].node == "/planning/planner"
    assert "/control/motor inactive" in system.states()


def test_the_end_calls_every_handler_of_the_tear_down(tmp_path: Path) -> None:
    text = """
    system: goodbye
    nodes:
      calm: {behavior: goodbye:Calm}
      bad: {behavior: goodbye:Bad}
      unready: {behavior: goodbye:Unready}
      plain: {}
    """
    module = """
    from composer.behavior import Behavior, TransitionFailed

    class Calm(Behavior):
        def on_deactivate(self): self.log.info("deactivate")
        def on_cleanup(self): self.log.info("cleanup")
        async def on_shutdown(self):
            await self.clock.sleep(0)
            self.log.info("shutdown")

    class Bad(Behavior):
        def on_shutdown(self): raise ValueError("no way to park")

    class Unready(Behavior):
        def on_deactivate(self): raise TransitionFailed("not now")
    """
    with running(text, tmp_path, goodbye=module) as system:
        outcome = system.stop()
    lines = [line for line in system.log() if "way" not in line and "not now" not in line]
    assert lines == ["deactivate", "cleanup", "shutdown"]
    assert "on_shutdown: ValueError: no way to park\nTraceback" in system.log_text()
    assert outcome.exit_code == 1
    assert {node.node: node.errors for node in outcome.nodes} == {
        "/calm": 0,
        "/bad": 1,
        "/unready": 0,
        "/plain": 0,
    }
    # A refused deactivation is reported, and followed by the shutdown.
    refused = next(e for e in system.reported(NodeTransitionFailed) if e.node == "/unready")
    assert (refused.state, refused.reason) == ("active", "not now")
    assert [node.state for node in outcome.nodes if node.node != "/bad"] == ["finalized"] * 3


def test_a_fault_that_was_not_handled_before_the_stop_counts(tmp_path: Path, peer: Peer) -> None:
    """The stop is requested during a command in which a node has failed."""
    text = """
    system: both
    nodes:
      broken: {behavior: both:Broken, lifecycle: {depends_on: [slow]}}
      slow: {behavior: both:Slow}
    """
    module = """
    from composer.behavior import Behavior

    class Broken(Behavior):
        def on_deactivate(self):
            raise ValueError("broken")

    class Slow(Behavior):
        async def on_deactivate(self):
            self.log.info("slow")
            await self.clock.sleep(0.5)
    """
    with running(text, tmp_path, both=module) as system:
        peer.client(Trigger, "/both/manager/pause").call_async(Trigger.Request())
        system.wait_for_log("slow")
        assert system.stop().exit_code == 1
