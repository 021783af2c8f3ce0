"""A system over several processes: one bring-up, and the failures of processes."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from lifecycle_msgs.srv import GetState
from std_srvs.srv import Trigger

from composer.runtime.supervision.events import (
    NodeFailed,
    NodeTransitionFailed,
    Restarted,
    RollingBack,
)
from tests.ros.members.split_robot import TEXT, alive, pid_of, split, states
from tests.ros.support.in_process import Peer, RunningSystem, wait_until

TOGETHER = """
system: robot
namespace: lab
lifecycle: {on_failure: restart, restart: {backoff_ms: 100}}
processes: {robots: {nodes: [base, lidar, safety]}}
nodes:
  base: {}
  lidar: {lifecycle: {depends_on: [base]}}
  safety: {lifecycle: {depends_on: [lidar]}}
  mission: {lifecycle: {depends_on: [safety, base]}}
"""
SHAKY = """
system: robot
namespace: lab
lifecycle: {on_failure: restart, restart: {backoff_ms: 1, backoff_max_ms: 1, max_attempts: 100}}
processes: {other: {nodes: [shaky]}, third: {nodes: [slow]}}
nodes:
  shaky:
    behavior: "shaky:Shaky"
    timers: {tick: {period_ms: 1}}
    lifecycle: {watch: {max_errors: 0}}
  slow:
    behavior: "shaky:Slow"
    timers: {tick: {period_ms: 1}}
    lifecycle: {watch: {max_errors: 0}}
"""
SHAKY_CODE = """
from composer.behavior import Behavior

class Shaky(Behavior):
    def on_tick(self):
        raise ValueError("shaken")

class Slow(Shaky):
    async def on_deactivate(self):
        await self.clock.sleep(0.5)
        raise ValueError("stuck")

    def on_error(self, cause):
        raise ValueError("broken")
"""


def all_alive(pids: set[int]) -> set[int]:
    return set(filter(alive, pids))


def test_up_in_order_data_flows_errors_count_and_down(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENCLAVE_OVERRIDE", "/lab/robot")
    with split(tmp_path, fail_on_error=True) as system:
        active = [text for text in system.states() if text.endswith(" active")]
        assert active == ["/lab/camera active", "/lab/detector active", "/lab/arm active"]
        system.wait_for_log("found picture")
        pids = [pid_of(system, name) for name in ("camera", "detector")]
        assert len({*pids, os.getpid()}) == 3
        assert os.sched_getaffinity(pids[0]) == {0}
        environment = Path("/proc", str(pids[0]), "environ").read_bytes()
        assert b"ROLE=sensing\0" in environment
        assert b"ROS_SECURITY_ENCLAVE_OVERRIDE=/lab/robot/sensing\0" in environment

        wait_until(
            lambda: all((node.sent_hz or 0) > 1 for node in system.report().nodes[:2]), "the rates"
        )
        known = [(node.host, node.pid) for node in system.report().nodes]
        host = socket.gethostname()
        others = [(host, str(pid)) for pid in pids]
        assert known == [*others, (host, str(os.getpid()))]

        # The nodes have their own services; what other tools do with them is followed.
        state = peer.call(GetState, "/lab/detector/get_state").current_state.label
        assert state == "active"
        assert peer.change("/lab/detector", "deactivate")
        wait_until(lambda: system.node("detector").state == "inactive", "the state")
        assert peer.change("/lab/detector", "activate")
        wait_until(lambda: system.node("detector").state == "active", "the state")
        # Errors in another process fail the run.
        assert peer.set_parameter("/lab/detector", "mood", "angry") == ""
        system.wait_for_log("no cat")
        outcome = system.stop()
        assert outcome.exit_code == 1
        assert not system.reported(NodeFailed)
        camera, detector, _ = outcome.nodes
        assert (camera.errors, detector.errors > 0) == (0, True)
        assert camera.sent >= detector.received > 0
        called = {callback.node: callback for callback in outcome.callbacks if callback.count}
        assert called.keys() == {"/lab/camera", "/lab/detector", "/lab/arm"}
        assert called["/lab/camera"].callback == "timer 'tick'"
        assert called["/lab/detector"].total_ms > 0.0
    wait_until(lambda: not all_alive(set(pids)), "the end of the processes")


def test_the_end_of_a_process_with_several_nodes_is_one_fact(tmp_path: Path) -> None:
    names = ["/lab/base", "/lab/lidar", "/lab/safety"]
    with split(tmp_path, TOGETHER) as system:
        os.kill(pid_of(system, "base"), signal.SIGKILL)
        wait_until(lambda: len(system.reported(Restarted)) >= len(names), "the restarts")
        (failed,) = system.reported(NodeFailed)
        assert sorted(failed.nodes) == names
        reason = "process 'robots' was ended by SIGKILL"
        assert (failed.reason, failed.consequence) == (reason, "restart 1 in 0.1 s")
        assert not system.reported(NodeTransitionFailed)
        texts = list(map(str, system.events))
        for name in names:  # not before it is active
            up = texts.index(f"{name} is up again after restart 1")
            changes = [text for text in texts[:up] if text.startswith(f"{name} ")]
            assert changes[-1] == f"{name} active"
        assert system.stop().exit_code == 0


def test_a_node_that_fails_as_soon_as_it_is_active_is_restarted(tmp_path: Path) -> None:
    """Not its process: the node does not hang, even if it is slow to go down and is finalized."""
    tmp_path.joinpath("shaky.py").write_text(SHAKY_CODE, encoding="utf-8")
    with split(tmp_path, SHAKY) as system:
        processes = {name: pid_of(system, name) for name in ("shaky", "slow")}
        wait_until(lambda: len(restarts(system, "/lab/shaky")) >= 10, "the restarts")
        wait_until(lambda: restarts(system, "/lab/slow"), "the restart")
        assert {name: pid_of(system, name) for name in processes} == processes
        assert {event.reason for event in system.reported(NodeFailed)} == {
            "more than 0 errors within 60 s"
        }


def restarts(system: RunningSystem, node: str) -> list[Restarted]:
    return [event for event in system.reported(Restarted) if event.node == node]


def test_a_bring_up_over_processes_is_rolled_back(tmp_path: Path) -> None:
    text = TEXT.replace('mood: ""', "mood: broken")
    idle = [f"idle_{number}" for number in range(10, 50)]  # more than a service keeps requests
    text += "".join(f"  {name}: {{process: acting}}\n" for name in idle)
    with split(tmp_path, text, all_or_nothing=True) as system:
        assert system.end().exit_code == 1
    assert "ValueError: no lens" in str(system.reported(RollingBack)[0])
    for name in ("/lab/camera", *(f"/lab/{name}" for name in idle)):
        assert system.states(name)[-2:] == [f"{name} unconfigured", f"{name} finalized"]
    assert "/lab/arm active" not in system.states()


# The tests from here on share a robot. Those before them run systems of their own.


@pytest.fixture(scope="module")
def robot(
    shared_domain_id: int, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[RunningSystem]:
    """A robot whose nodes are active before and after each test."""
    with split(tmp_path_factory.mktemp("robot")) as system:
        yield system


def wait_for_restart(system: RunningSystem, node: str, cause: Callable[[], object]) -> NodeFailed:
    """Cause a failure of a node; return it when all nodes are active again."""
    failures, restarts = len(system.reported(NodeFailed)), len(system.reported(Restarted))
    cause()
    wait_until(lambda: len(system.reported(Restarted)) > restarts, "the restart")
    wait_until(lambda: states(system) == {"active"}, "all nodes")
    return next(event for event in system.reported(NodeFailed)[failures:] if node in event.nodes)


def test_a_killed_process_is_a_failure_of_its_nodes(robot: RunningSystem) -> None:
    other, killed = pid_of(robot, "detector"), pid_of(robot, "camera")
    failed = wait_for_restart(robot, "/lab/camera", lambda: os.kill(killed, signal.SIGKILL))
    # Noticed by the end of the process, not by missing reports.
    assert failed.reason == "process 'sensing' was ended by SIGKILL"
    for name in ("/lab/detector", "/lab/arm"):  # paused, and in this order active again
        assert robot.states(name)[-2:] == [f"{name} inactive", f"{name} active"]
    assert pid_of(robot, "detector") == other
    assert pid_of(robot, "camera") != killed


def test_a_failed_node_of_another_process_is_restarted(robot: RunningSystem, peer: Peer) -> None:
    def hang() -> None:
        failures = len(robot.reported(NodeFailed))
        assert peer.set_parameter("/lab/detector", "mood", "hang") == ""
        wait_until(lambda: len(robot.reported(NodeFailed)) > failures, "the failure")
        assert peer.set_parameter("/lab/detector", "mood", "") == ""

    process = pid_of(robot, "detector")
    failed = wait_for_restart(robot, "/lab/detector", hang)
    assert "took longer than 300 ms" in failed.reason
    assert pid_of(robot, "detector") == process


def test_a_process_with_a_blocked_node_is_started_again(robot: RunningSystem, peer: Peer) -> None:
    def block() -> None:
        assert peer.set_parameter("/lab/detector", "mood", "block") == ""

    process = pid_of(robot, "detector")
    failed = wait_for_restart(robot, "/lab/detector", block)
    assert "on_image" in failed.reason
    assert pid_of(robot, "detector") != process
    assert not alive(process)


def test_a_reset_creates_a_node_that_was_shut_down_again(robot: RunningSystem, peer: Peer) -> None:
    """In its process, not only in the reports of the coordinating one."""
    failures = len(robot.reported(NodeFailed))
    process = pid_of(robot, "detector")
    assert peer.change("/lab/detector", "shutdown")
    wait_until(lambda: robot.node("detector").state == "finalized", "the state")
    finalized = peer.servers("/lab/detector/get_state")
    assert peer.call(Trigger, "/lab/robot/manager/reset").success
    assert states(robot) == {"unconfigured"}
    wait_until(lambda: peer.servers("/lab/detector/get_state") - finalized, "the new node")
    assert peer.state("/lab/detector") == "unconfigured"
    assert peer.call(Trigger, "/lab/robot/manager/startup").success
    assert states(robot) == {"active"}
    assert pid_of(robot, "detector") == process
    assert len(robot.reported(NodeFailed)) == failures
