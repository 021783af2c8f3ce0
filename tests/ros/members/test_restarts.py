"""Failures of processes and nodes, and a reset, of a robot that is active again each time."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator

import pytest
from std_srvs.srv import Trigger

from composer.runtime.supervision.events import NodeFailed, Restarted
from tests.ros.members.split_robot import alive, pid_of, split, states
from tests.ros.support.in_process import Peer, RunningSystem, wait_until


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
