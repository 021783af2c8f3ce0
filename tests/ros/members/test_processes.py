"""A system over several processes: one bring-up, and the failures of processes."""

from __future__ import annotations

import os
import signal
import socket
from pathlib import Path

import pytest
from lifecycle_msgs.srv import GetState
from std_srvs.srv import Trigger

from composer.runtime.ros_graph.graph import participant, servers_of
from composer.runtime.supervision.events import (
    NodeFailed,
    NodeTransitionFailed,
    Restarted,
    RollingBack,
)
from tests.ros.members.split_robot import TEXT, split, states
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
processes: {other: {nodes: [shaky]}}
nodes:
  shaky:
    behavior: shaky:Shaky
    timers: {tick: {period_ms: 1}}
    lifecycle: {watch: {max_errors: 0}}
"""
SHAKEN = "more than 0 errors within 60 s"
SHAKY_CODE = """
from composer.behavior import Behavior

class Shaky(Behavior):
    def on_tick(self):
        raise ValueError("shaken")
"""
SLOWLY_FINALIZED = """
    async def on_deactivate(self):
        await self.clock.sleep(0.5)
        raise ValueError("stuck")

    def on_error(self, cause):
        raise ValueError("broken")
"""


def pid_of(system: RunningSystem, node: str) -> int:
    pid = system.node(node).pid
    assert pid is not None
    return int(pid)


def wait_for_restart(system: RunningSystem, node: str, count: int = 1) -> NodeFailed:
    wait_until(lambda: len(system.reported(Restarted)) >= count, "the restart")
    wait_until(lambda: states(system) == {"active"}, "all nodes")
    return next(event for event in system.reported(NodeFailed) if node in event.nodes)


def alive(pid: int) -> bool:
    return Path("/proc", str(pid)).exists()


def all_alive(pids: set[int]) -> set[int]:
    return set(filter(alive, pids))


def test_up_in_order_data_flows_and_down(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENCLAVE_OVERRIDE", "/lab/robot")
    with split(tmp_path) as system:
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
        assert known == [*others, ("", str(os.getpid()))]

        # The nodes have their own services; what other tools do with them is followed.
        state = peer.call(GetState, "/lab/detector/get_state").current_state.label
        assert state == "active"
        assert peer.change("/lab/detector", "deactivate")
        wait_until(lambda: system.node("detector").state == "inactive", "the state")
        assert peer.change("/lab/detector", "activate")
        wait_until(lambda: system.node("detector").state == "active", "the state")
        outcome = system.stop()
        assert outcome.exit_code == 0
        assert not system.reported(NodeFailed)
        called = {callback.node: callback for callback in outcome.callbacks if callback.count}
        assert called.keys() == {"/lab/camera", "/lab/detector", "/lab/arm"}
        assert called["/lab/camera"].callback == "timer 'tick'"
        assert called["/lab/detector"].total_ms > 0.0
    wait_until(lambda: not all_alive(set(pids)), "the end of the processes")


def test_a_killed_process_is_a_failure_of_its_nodes(tmp_path: Path) -> None:
    with split(tmp_path) as system:
        other, killed = pid_of(system, "detector"), pid_of(system, "camera")
        requests = system.host._node_set.other_processes._processes["sensing"].requests
        participant_before = requests._participant
        os.kill(killed, signal.SIGKILL)
        failed = wait_for_restart(system, "/lab/camera")
        # Noticed by the end of the process, not by missing reports.
        assert failed.reason == "process 'sensing' was ended by SIGKILL"
        for name in ("/lab/detector", "/lab/arm"):  # paused, and in this order active again
            assert system.states(name)[-2:] == [f"{name} inactive", f"{name} active"]
        assert pid_of(system, "detector") == other
        assert pid_of(system, "camera") != killed
        # Requests go to the service of the new process, not to that which DDS still knows.
        known = {
            participant(server).hex() for server in servers_of(requests._ros, requests._service)
        }
        assert participant_before != requests._participant
        assert requests._participant in known


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


def test_a_failed_node_of_another_process_is_restarted(tmp_path: Path, peer: Peer) -> None:
    with split(tmp_path) as system:
        process = pid_of(system, "detector")
        assert peer.set_parameter("/lab/detector", "mood", "hang") == ""
        wait_until(lambda: system.reported(NodeFailed), "the failure")
        assert peer.set_parameter("/lab/detector", "mood", "") == ""
        failed = wait_for_restart(system, "/lab/detector")
        assert "took longer than 300 ms" in failed.reason
        assert pid_of(system, "detector") == process


def test_a_node_that_fails_as_soon_as_it_is_active_is_restarted(tmp_path: Path) -> None:
    tmp_path.joinpath("shaky.py").write_text(SHAKY_CODE, encoding="utf-8")
    with split(tmp_path, SHAKY) as system:
        process = pid_of(system, "shaky")
        wait_until(lambda: len(system.reported(Restarted)) >= 10, "the restarts")
        assert pid_of(system, "shaky") == process
        assert {event.reason for event in system.reported(NodeFailed)} == {SHAKEN}


def test_a_failed_node_may_take_time_to_go_down(tmp_path: Path) -> None:
    """It does not hang, so its process is not ended, not even if the node ends up finalized."""
    tmp_path.joinpath("shaky.py").write_text(SHAKY_CODE + SLOWLY_FINALIZED, encoding="utf-8")
    with split(tmp_path, SHAKY) as system:
        process = pid_of(system, "shaky")
        wait_until(lambda: system.reported(Restarted), "the restart")
        assert pid_of(system, "shaky") == process
        assert {event.reason for event in system.reported(NodeFailed)} == {SHAKEN}


def test_a_process_with_a_blocked_node_is_started_again(tmp_path: Path, peer: Peer) -> None:
    with split(tmp_path) as system:
        process = pid_of(system, "detector")
        assert peer.set_parameter("/lab/detector", "mood", "block") == ""
        failed = wait_for_restart(system, "/lab/detector")
        assert "on_image" in failed.reason
        assert pid_of(system, "detector") != process
        assert not alive(process)


def test_a_reset_creates_a_node_that_was_shut_down_again(tmp_path: Path, peer: Peer) -> None:
    """In its process, not only in the reports of the coordinating one."""
    with split(tmp_path) as system:
        process = pid_of(system, "detector")
        assert peer.change("/lab/detector", "shutdown")
        wait_until(lambda: system.node("detector").state == "finalized", "the state")
        finalized = peer.servers("/lab/detector/get_state")
        assert peer.call(Trigger, "/lab/robot/manager/reset").success
        assert states(system) == {"unconfigured"}
        wait_until(lambda: peer.servers("/lab/detector/get_state") - finalized, "the new node")
        assert peer.state("/lab/detector") == "unconfigured"
        assert peer.call(Trigger, "/lab/robot/manager/startup").success
        assert states(system) == {"active"}
        assert pid_of(system, "detector") == process
        assert not system.reported(NodeFailed)


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


def test_errors_in_another_process_fail_the_run(tmp_path: Path) -> None:
    text = TEXT.replace('mood: ""', "mood: angry")
    with split(tmp_path, text, fail_on_error=True) as system:
        system.wait_for_log("no cat")
        outcome = system.stop()
    summaries = {node.node: node for node in outcome.nodes}
    assert outcome.exit_code == 1
    assert summaries["/lab/detector"].errors > 0
    assert summaries["/lab/detector"].received > 0
    assert summaries["/lab/camera"].errors == 0
    assert summaries["/lab/camera"].sent >= summaries["/lab/detector"].received


@pytest.mark.soak
@pytest.mark.timeout(1800)
def test_any_process_is_killed_fifty_times(tmp_path: Path) -> None:
    """Recovery by policy; nothing is left, and nothing runs twice."""
    text = TEXT.replace("max_attempts: 5", "max_attempts: 1000")
    text = text.replace("backoff_ms: 100}", "backoff_ms: 100, max_attempts: 1000}")
    pids: set[int] = set()
    with split(tmp_path, text) as system:
        for round_ in range(50):
            name = ("camera", "detector")[round_ % 2]
            pid = pid_of(system, name)
            pids |= {pid_of(system, "camera"), pid_of(system, "detector")}
            os.kill(pid, signal.SIGKILL)
            count = round_ + 1
            wait_until(lambda n=count: len(system.reported(Restarted)) >= n, "the restart")
            wait_until(lambda: states(system) == {"active"}, f"all nodes in round {count}")
            running_now = {pid_of(system, "camera"), pid_of(system, "detector")}
            pids |= running_now
            wait_until(lambda now=running_now, known=pids: all_alive(known) == now, "no double")
        assert system.stop().exit_code == 0
    wait_until(lambda: not all_alive(pids), "the end of the processes")
