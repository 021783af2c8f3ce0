"""Processes that outlive the one that coordinates them, who starts them, and how all end."""

from __future__ import annotations

import re
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest
from lifecycle_msgs.msg import TransitionEvent
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from composer.runtime.host_options import HostOptions
from composer.runtime.manager.other_instances import Instance
from composer.runtime.members.kept_goals import KeptGoals
from composer.runtime.process.instance_lock import (
    goals_path,
    hold_instance_lock,
    is_held,
    local_systems,
)
from composer.runtime.ros.service_requests import STATE_QOS
from composer.runtime.supervision.events import NodeFailed
from tests.ros.members.split_robot import (
    DETECTOR,
    TEXT,
    command_of,
    members,
    split,
    start_member,
    states,
)
from tests.ros.support.commands import code_of_end
from tests.ros.support.forked import ForkedCommand
from tests.ros.support.in_process import PATIENCE_S, Peer, RunningSystem, system_of, wait_until
from tests.ros.support.system_process import RunningSystem as CommandProcess
from tests.ros.support.system_process import write_system


@pytest.mark.timeout(200)
def test_processes_outlive_the_coordinator_if_it_did_not_start_them(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Those that run here are awaited for longer.
    monkeypatch.setattr("composer.runtime.supervision.start_and_end.STARTED_REPORT_WITHIN_S", 0.0)
    # With this backoff, the process returns before the coordinator starts one in its place.
    text = TEXT.replace("backoff_ms: 100", "backoff_ms: 10000")
    text = text.replace("  arm:\n", "  arm:\n    behavior: detector:Arm\n")
    path = write_system(tmp_path, text, detector=DETECTOR)
    with members(path, "sensing", "acting") as processes:
        wait_until(lambda: len(running_managers(peer)) == 2, "the processes", 2.0 * PATIENCE_S)
        moves = coordinate_and_pause(path, peer)
        with split(tmp_path, text) as system:  # another one, and the pause goes on
            assert system.node("camera").pid is None
            assert system.report().activity == "paused"
            assert states(system) == {"inactive"}
            assert not moves
            assert peer.call(Trigger, "/lab/robot/manager/resume").success
            system.wait_for_log("found picture")
            assert states(system) == {"active"}
            forget(moves, "active")
            found = peer.listen(String, "/lab/found")
            wait_until(lambda: len(found) > 10, "messages")
            assert not system.reported(NodeFailed)
            assert not moves

            processes[0].kill()
            failed = wait_for_failure(system)
            # Only what has started it may start it again, whatever the policy.
            assert str(failed).endswith("process 'sensing' has ended; waiting for it")
            assert system.node("detector").state == "inactive"
            processes[0].wait()
            processes[0] = start_member(path, "sensing")
            wait_until(lambda: states(system) == {"active"}, "the return", 2.0 * PATIENCE_S)

            forget(moves, "active")
            stop_until_the_pause(processes[1], system, peer)
            wait_until(lambda: states(system) == {"active"}, "the return", 2.0 * PATIENCE_S)
            assert not moves  # it was active all the time
            assert system.node("camera").activations == 2
            # Refused, because of one on another computer: the nodes belong to that.
            older = Instance("elsewhere", 4321, 3600.0)
            system.host.on_older_instance("/lab/robot", older)
            assert "already runs" in system.end().reason
            found.clear()
            wait_until(lambda: len(found) > 10, "messages of nodes that are still active")
            assert not moves
        assert all(member.poll() is None for member in processes)
    assert [member.returncode for member in processes] == [0, 0]


def stop_until_the_pause(member: ForkedCommand, system: RunningSystem, peer: Peer) -> None:
    """Stop the process of the detector; let it return before the pause is complete."""
    reports = peer.listen(String, "/lab/robot/acting/manager/state", STATE_QOS)
    wait_until(lambda: reports, "a report")
    changes = len(system.states("/lab/arm"))
    system.behavior("arm").is_held = True
    member.send_signal(signal.SIGSTOP)
    wait_until(lambda: system.node("arm").state == "deactivating", "the pause")
    failed = system.reported(NodeFailed)[-1]
    assert failed.nodes == ("/lab/detector",)
    assert failed.reason == "process 'acting' has not reported for 5 s"
    reports.clear()
    member.send_signal(signal.SIGCONT)
    wait_until(lambda: reports, "its return")
    system.behavior("arm").is_held = False
    wait_until(lambda: system.states("/lab/arm")[changes:], "the end of the pause")
    assert system.states("/lab/arm")[changes] == "/lab/arm inactive"


def coordinate_and_pause(path: Path, peer: Peer) -> list[TransitionEvent]:
    """Let two coordinators run one after the other, and be killed; return moves of the detector.

    The first one leaves a node that a user has deactivated, the second one a pause.
    """
    with CommandProcess(str(path)) as coordinator:
        coordinator.wait_for("3 of 3 nodes active")
        moves = peer.listen(TransitionEvent, "/lab/detector/transition_event")
        assert peer.change("/lab/arm", "deactivate")
        wait_for_goals("arm", "running")
        coordinator.stop(signal.SIGKILL)
    found = peer.listen(String, "/lab/found")
    wait_until(lambda: len(found) > 10, "messages without the coordinator")
    with CommandProcess(str(path)) as coordinator:
        coordinator.wait_for("2 of 3 nodes active")
        assert not moves
        assert peer.call(Trigger, "/lab/robot/manager/pause").success
        wait_for_goals("camera", "paused")
        coordinator.stop(signal.SIGKILL)
    forget(moves, "inactive")
    return moves


def wait_for_goals(node: str, activity: str) -> None:
    """Wait until the coordinator has kept that a node is to be inactive, and the activity."""
    kept = KeptGoals(system_of(TEXT, Path()), goals_path("/lab/robot"))

    def are_kept() -> bool:
        goals, kept_activity = kept.read() or ({}, "")
        return goals.get(node) is PrimaryState.INACTIVE and kept_activity == activity

    wait_until(are_kept, "the goals")


def forget(moves: list[TransitionEvent], goal: str) -> None:
    """Wait for the event of the last transition, and forget all."""
    wait_until(lambda: moves and moves[-1].goal_state.label == goal, f"the event of '{goal}'")
    moves.clear()


def test_only_one_of_two_starters_runs_a_process(tmp_path: Path) -> None:
    # The coordinator starts both as well, at the same time.
    command = [*command_of(write_system(tmp_path, TEXT, detector=DETECTOR)), "--process"]
    processes = [
        subprocess.Popen([*command, name], stderr=subprocess.PIPE, text=True)
        for name in ("sensing", "acting")
    ]
    try:
        with split(tmp_path) as system:
            assert states(system) == {"active"}
            for member, node in zip(processes, ("camera", "detector"), strict=True):
                if system.node(node).pid is not None:
                    assert "already runs in ROS domain" in member.communicate(timeout=60.0)[1]
                    assert member.returncode == 1
            assert "already runs" not in system.log_text()
            assert not system.reported(NodeFailed)
    finally:
        for member in processes:
            member.send_signal(signal.SIGINT)
            member.wait(PATIENCE_S)


def test_the_last_counters_of_processes_that_stay(tmp_path: Path) -> None:
    path = write_system(tmp_path, TEXT, detector=DETECTOR)
    with members(path, "sensing", "acting") as processes:
        wait_until(lambda: len(local_systems()) == 2, "the processes")
        with split(tmp_path) as system:
            found = system.node("arm").statistics
            wait_until(lambda: found.received > 20, "messages")
            outcome = system.stop()
        assert [member.poll() for member in processes] == [None, None]
    camera, detector, arm = outcome.nodes
    # Each is deactivated after the nodes that receive its messages.
    assert camera.sent >= detector.received >= detector.sent >= arm.received > 20


def test_a_process_is_started_once_its_lock_is_free(tmp_path: Path) -> None:
    """It may belong to a process that is about to end with an earlier coordinator."""
    with hold_instance_lock("/lab/robot/sensing"):
        path = write_system(tmp_path, TEXT)
        options = HostOptions(stop_within_s=20.0, member_command=command_of(path))
        system = RunningSystem(system_of(TEXT, tmp_path, detector=DETECTOR), options, None)
        wait_until(lambda: len(system.host.nodes) == 3, "the nodes")
        wait_until(lambda: system.node("detector").pid, "the start of the other process")
        assert system.node("camera").pid is None
    try:
        wait_until(lambda: states(system) == {"active"}, "all nodes")
        assert system.node("camera").pid is not None
    finally:
        system.stop()


def running_managers(peer: Peer) -> list[str]:
    """Return the manager nodes of processes that are up."""
    names = ("/lab/robot/sensing/manager", "/lab/robot/acting/manager")
    return [name for name in names if peer.node.count_publishers(f"{name}/state")]


def wait_for_failure(system: RunningSystem) -> NodeFailed:
    wait_until(lambda: system.reported(NodeFailed), "the failure")
    wait_until(lambda: system.node("detector").state == "inactive", "the pause")
    return system.reported(NodeFailed)[0]


#: Each node depends on the one before it; the letter is its process, h the coordinating one.
CHAIN = ("a1", "a2", "a3", "b4", "a5", "h6", "b7", "b8", "a9")
ATTEMPTS = 3
BEHAVIOR = """
import os
from composer.behavior import Behavior

class Recorder(Behavior):
    def record(self, transition):
        line = f"{transition} {self.name}\\n".encode()
        descriptor = os.open(os.environ["RECORD"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        os.write(descriptor, line)
        os.close(descriptor)

    async def on_deactivate(self):
        await self.clock.sleep(0.01)  # a node that does not wait for it is recorded first
        self.record("deactivate")

    async def on_shutdown(self):
        await self.clock.sleep(0.01)
        self.record("shutdown")
"""


def write_chain(folder: Path, *processes: str) -> Path:
    entries = ", ".join(f"{name}: {{nodes: ['{name}*']}}" for name in processes)
    lines = ["system: chain", f"processes: {{{entries}}}", "nodes:"]
    for index, name in enumerate(CHAIN):
        needs = f", lifecycle: {{depends_on: [{CHAIN[index - 1]}]}}" if index else ""
        lines.append(f"  {name}: {{behavior: 'recorder:Recorder'{needs}}}")
    return write_system(folder, "\n".join(lines), recorder=BEHAVIOR)


def recorded(folder: Path, transition: str) -> Sequence[str]:
    lines = (folder / "record").read_text(encoding="ascii").splitlines()
    return [line.split("/")[1] for line in lines if line.split()[0] == transition]


def test_a_chain_over_processes_goes_down_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = tmp_path / "record"
    monkeypatch.setenv("RECORD", str(record))
    path = write_chain(tmp_path, "a", "b")

    def goes_down_in_time() -> bool:
        record.unlink(missing_ok=True)
        with CommandProcess(str(path)) as system:
            system.wait_for("9 of 9 nodes active")
            code, _ = system.stop(signal.SIGTERM)
            output = system.output
        assert code == code_of_end(output), output
        if len(re.findall(r"^/\w\d +finalized ", output, re.MULTILINE)) < len(CHAIN):
            return False
        assert recorded(tmp_path, "deactivate") == list(reversed(CHAIN))
        assert recorded(tmp_path, "shutdown") == list(reversed(CHAIN))
        return code == 0

    # The machine may not run one of the processes for a moment: the system does not wait for it.
    assert any(goes_down_in_time() for _ in range(ATTEMPTS))


def test_a_process_that_ends_by_itself_takes_its_nodes_down_in_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RECORD", str(tmp_path / "record"))
    path = write_chain(tmp_path, "a")
    with members(path, "a") as (member,):
        wait_until(lambda: is_held("/chain/a"), "the process")
        with CommandProcess(str(path)) as system:
            system.wait_for("9 of 9 nodes active")
            system.stop(signal.SIGKILL)
            member.send_signal(signal.SIGINT)
            assert member.wait(60) == 0
    own = [name for name in reversed(CHAIN) if name.startswith("a")]
    down = [name for name in recorded(tmp_path, "shutdown") if name.startswith("a")]
    assert down == own
