"""A system over several processes: one bring-up, and the failures of processes."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from std_srvs.srv import Trigger

from composer.runtime.protocol.reports import NodeReport
from composer.runtime.supervision.events import (
    NodeFailed,
    NodeTransitionFailed,
    Restarted,
    RollingBack,
)
from tests.ros.members.split_robot import (
    TEXT,
    TWO_PROCESSES,
    alive,
    pid_of,
    split,
    states,
)
from tests.ros.support.in_process import Peer, RunningSystem, wait_until

#: A process has two nodes.
ROBOT = (
    TEXT.replace("nodes: [camera]", "nodes: [camera, lidar]").replace(
        "depends_on: [camera]", "depends_on: [lidar]"
    )
    + "  lidar: {lifecycle: {depends_on: [camera]}}\n"
)
SHAKY = """
system: robot
namespace: lab
lifecycle: {on_failure: restart, restart: {backoff_ms: 1, backoff_max_ms: 1, max_attempts: 100}}
processes: {other: {nodes: [shaky, slow]}}
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


def test_errors_of_another_process_count_and_fail_the_run(tmp_path: Path, peer: Peer) -> None:
    with split(tmp_path, TWO_PROCESSES, fail_on_error=True) as system:
        pid = pid_of(system, "detector")
        system.wait_for_log("found picture")
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
        assert called["/lab/detector"].callback == "subscription 'image'"
        assert called["/lab/detector"].total_ms > 0.0
    wait_until(lambda: not alive(pid), "the end of the process")


def test_a_node_that_fails_as_soon_as_it_is_active_is_restarted(tmp_path: Path) -> None:
    """Not its process: the node does not hang, even if it is slow to go down and is finalized."""
    tmp_path.joinpath("shaky.py").write_text(SHAKY_CODE, encoding="utf-8")
    with split(tmp_path, SHAKY) as system:
        process = pid_of(system, "shaky")
        wait_until(lambda: len(restarts(system, "/lab/shaky")) >= 10, "the restarts")
        wait_until(lambda: restarts(system, "/lab/slow"), "the restart")
        assert pid_of(system, "shaky") == pid_of(system, "slow") == process
        assert {event.reason for event in system.reported(NodeFailed)} == {
            "more than 0 errors within 60 s"
        }


def restarts(system: RunningSystem, node: str) -> list[Restarted]:
    return [event for event in system.reported(Restarted) if event.node == node]


def test_a_bring_up_over_processes_is_rolled_back(tmp_path: Path) -> None:
    text = TWO_PROCESSES.replace('mood: ""', "mood: broken")
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
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("ROS_SECURITY_ENCLAVE_OVERRIDE", "/lab/robot")
        with split(tmp_path_factory.mktemp("robot"), ROBOT) as system:
            yield system


def test_up_in_order_data_flows_and_transitions_are_followed(
    robot: RunningSystem, peer: Peer
) -> None:
    active = [text for text in robot.states() if text.endswith(" active")]
    names = ("camera", "lidar", "detector", "arm")
    assert active[: len(names)] == [f"/lab/{name} active" for name in names]
    robot.wait_for_log("found picture")
    pids = [pid_of(robot, name) for name in ("camera", "detector")]
    assert len({*pids, os.getpid()}) == 3
    assert os.sched_getaffinity(pids[0]) == {0}
    environment = Path("/proc", str(pids[0]), "environ").read_bytes()
    assert b"ROLE=sensing\0" in environment
    assert b"ROS_SECURITY_ENCLAVE_OVERRIDE=/lab/robot/sensing\0" in environment

    def reports() -> dict[str, NodeReport]:
        return {node.node: node for node in robot.report().nodes}

    for name in names[::2]:
        wait_until(lambda name=f"/lab/{name}": (reports()[name].sent_hz or 0) > 1, "the rates")
    known = [(reports()[f"/lab/{name}"].host, reports()[f"/lab/{name}"].pid) for name in names]
    host = socket.gethostname()
    assert known == [(host, str(pid)) for pid in (pids[0], *pids, os.getpid())]

    # The nodes have their own services; what other tools do with them is followed.
    assert peer.state("/lab/detector") == "active"
    assert peer.change("/lab/detector", "deactivate")
    wait_until(lambda: robot.node("detector").state == "inactive", "the state")
    assert peer.change("/lab/detector", "activate")
    wait_until(lambda: states(robot) == {"active"}, "the states")


def wait_for_restart(system: RunningSystem, node: str, cause: Callable[[], object]) -> NodeFailed:
    """Cause a failure of a node; return it when all nodes are active again."""
    failures, restarted = len(system.reported(NodeFailed)), len(restarts(system, node))
    cause()
    wait_until(lambda: len(restarts(system, node)) > restarted, "the restart")
    wait_until(lambda: states(system) == {"active"}, "all nodes")
    return next(event for event in system.reported(NodeFailed)[failures:] if node in event.nodes)


def test_a_killed_process_is_one_failure_of_its_nodes(robot: RunningSystem) -> None:
    other, killed = pid_of(robot, "detector"), pid_of(robot, "camera")
    before = len(robot.events)
    failed = wait_for_restart(robot, "/lab/lidar", lambda: os.kill(killed, signal.SIGKILL))
    wait_until(lambda: restarts(robot, "/lab/camera"), "the other restart")
    # Noticed by the end of the process, not by missing reports.
    reason = "process 'sensing' was ended by SIGKILL"
    assert (failed.reason, failed.consequence) == (reason, "restart 1 in 0.1 s")
    names = ("/lab/camera", "/lab/lidar")
    assert tuple(sorted(failed.nodes)) == names
    events = robot.events[before:]
    failures = [item for item in events if isinstance(item, NodeFailed | NodeTransitionFailed)]
    assert failures == [failed]
    texts = list(map(str, events))
    for name in names:  # not before it is active
        up = texts.index(f"{name} is up again after restart 1")
        changes = [text for text in texts[:up] if text.startswith(f"{name} ")]
        assert changes[-1] == f"{name} active"
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
