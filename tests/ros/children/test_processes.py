"""A system over several processes: one bring-up, and the failures of processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from lifecycle_msgs.srv import GetState
from std_msgs.msg import String

from composer.runtime.host import HostOptions
from composer.runtime.supervision.events import NodeFailed, Restarted, RollingBack
from tests.ros.support.in_process import Peer, RunningSystem, running, wait_until
from tests.ros.support.system_process import RunningSystem as CommandProcess

TEXT = """
system: robot
namespace: lab
lifecycle: {on_failure: restart, restart: {backoff_ms: 100}}
processes:
  sensing: {nodes: [camera], cpus: [0], environment: {ROLE: sensing}}
  acting: {}
nodes:
  camera:
    publishers: {image: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 50, publish: {image: {data: picture}}}}
  detector:
    process: acting
    behavior: detector:Detector
    parameters: {mood: ""}
    subscriptions: {image: {type: std_msgs/msg/String, qos: command}}
    publishers: {found: {type: std_msgs/msg/String, qos: command}}
    lifecycle: {depends_on: [camera], watch: {callback_ms: 300}}
  arm:
    subscriptions: {found: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
    lifecycle: {depends_on: [detector]}
"""
DETECTOR = """
import time
from composer.behavior import Behavior

class Detector(Behavior):
    def on_image(self, message):
        while self.parameters.mood == "hang":
            time.sleep(0.01)
        if self.parameters.mood == "block":
            time.sleep(60.0)  # cannot be interrupted
        found = self.publishers.found
        found.publish(found.message_type(data=f"found {message.data}"))
"""

ARM = """
from composer.behavior import Behavior

class Arm(Behavior):
    def on_configure(self):
        raise ValueError("no arm")
"""


def command_of(path: Path) -> tuple[str, ...]:
    return (sys.executable, "-m", "composer", "run", str(path))


@contextmanager
def split(folder: Path, text: str = TEXT) -> Iterator[RunningSystem]:
    """Run the system as ``compose run`` does, with this process as the coordinating one."""
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    options = HostOptions(stop_within_s=6.0, member_command=command_of(path))
    with running(text, folder, options=options, detector=DETECTOR) as system:
        try:
            yield system
        except AssertionError as error:
            error.add_note("the system reported:\n" + "\n".join(map(str, system.events)))
            raise


def pid_of(system: RunningSystem, node: str) -> int:
    pid = system.node(node).pid
    assert pid is not None
    return int(pid)


def states(system: RunningSystem) -> set[str]:
    return {system.node(name).state for name in ("camera", "detector", "arm")}


def wait_for_restart(system: RunningSystem, node: str, count: int = 1) -> NodeFailed:
    wait_until(lambda: len(system.reported(Restarted)) >= count, "the restart")
    wait_until(lambda: states(system) == {"active"}, "all nodes")
    return next(event for event in system.reported(NodeFailed) if event.node == node)


def alive(pid: int) -> bool:
    return Path("/proc", str(pid)).exists()


def all_alive(pids: set[int]) -> set[int]:
    return set(filter(alive, pids))


def test_up_in_order_data_flows_and_down(tmp_path: Path, peer: Peer) -> None:
    with split(tmp_path) as system:
        active = [text for text in system.states() if text.endswith(" active")]
        assert active == ["/lab/camera active", "/lab/detector active", "/lab/arm active"]
        system.wait_for_log("found picture")
        pids = [pid_of(system, name) for name in ("camera", "detector")]
        assert len({*pids, os.getpid()}) == 3
        assert os.sched_getaffinity(pids[0]) == {0}
        environment = Path("/proc", str(pids[0]), "environ").read_bytes()
        assert b"ROLE=sensing\0" in environment

        reported = system.host._status.snapshot  # with the rates that the processes report
        wait_until(lambda: all(node.sent_hz > 1 for node in reported().nodes[:2]), "the rates")

        # The nodes have their own services; what other tools do with them is followed.
        state = peer.call(GetState, "/lab/detector/get_state").current_state.label
        assert state == "active"
        assert peer.change("/lab/detector", "deactivate")
        wait_until(lambda: system.node("detector").state == "inactive", "the state")
        assert peer.change("/lab/detector", "activate")
        wait_until(lambda: system.node("detector").state == "active", "the state")
        assert system.stop().exit_code == 0
        assert not system.reported(NodeFailed)
    wait_until(lambda: not all_alive(set(pids)), "the end of the processes")


def test_a_killed_process_is_a_failure_of_its_nodes(tmp_path: Path) -> None:
    with split(tmp_path) as system:
        other, killed = pid_of(system, "detector"), pid_of(system, "camera")
        killed_s = time.monotonic() - system.host._reporter._started_at_s
        os.kill(killed, signal.SIGKILL)
        failed = wait_for_restart(system, "/lab/camera")
        assert failed.reason == "process 'sensing' was ended by signal 9"
        assert failed.elapsed_s - killed_s < 0.1 * max(1.0, os.getloadavg()[0])
        for name in ("/lab/detector", "/lab/arm"):  # paused, and in this order active again
            assert system.states(name)[-2:] == [f"{name} inactive", f"{name} active"]
        assert pid_of(system, "detector") == other
        assert pid_of(system, "camera") != killed


def test_a_failed_node_of_another_process_is_restarted(tmp_path: Path, peer: Peer) -> None:
    with split(tmp_path) as system:
        process = pid_of(system, "detector")
        assert peer.set_parameter("/lab/detector", "mood", "hang") == ""
        wait_until(lambda: system.reported(NodeFailed), "the failure")
        assert peer.set_parameter("/lab/detector", "mood", "") == ""
        failed = wait_for_restart(system, "/lab/detector")
        assert "took longer than 300 ms" in failed.reason
        assert pid_of(system, "detector") == process


def test_a_process_with_a_blocked_node_is_started_again(tmp_path: Path, peer: Peer) -> None:
    with split(tmp_path) as system:
        process = pid_of(system, "detector")
        assert peer.set_parameter("/lab/detector", "mood", "block") == ""
        failed = wait_for_restart(system, "/lab/detector")
        assert "on_image" in failed.reason
        assert pid_of(system, "detector") != process
        assert not alive(process)


def test_a_bring_up_over_processes_is_rolled_back(tmp_path: Path) -> None:
    log = 'log: "{message.data}"}}'
    text = TEXT.replace(log, log + "\n    behavior: arm:Arm")
    tmp_path.joinpath("arm.py").write_text(ARM, encoding="utf-8")
    with split(tmp_path, text) as system:
        assert system.end().exit_code == 1
    assert "configure failed: ValueError: no arm" in str(system.reported(RollingBack)[0])
    for name in ("/lab/camera", "/lab/detector"):
        assert system.states(name)[-2:] == [f"{name} unconfigured", f"{name} finalized"]


@pytest.mark.timeout(120)
def test_processes_outlive_the_coordinator_if_it_did_not_start_them(
    tmp_path: Path, peer: Peer
) -> None:
    path = tmp_path / "robot.yaml"
    # With this backoff, the process returns before the coordinator starts one in its place.
    text = TEXT.replace("backoff_ms: 100", "backoff_ms: 10000")
    path.write_text(text, encoding="utf-8")
    tmp_path.joinpath("detector.py").write_text(DETECTOR, encoding="utf-8")
    members = [
        subprocess.Popen([*command_of(path), "--process", name], stderr=subprocess.DEVNULL)
        for name in ("sensing", "acting")
    ]
    try:
        wait_until(lambda: len(running_managers(peer)) == 2, "the processes")
        with CommandProcess(str(path)) as coordinator:
            coordinator.wait_for("3 of 3 nodes active")
            coordinator.stop(signal.SIGKILL)
        found = peer.listen(String, "/lab/found")
        wait_until(lambda: len(found) > 10, "messages without the coordinator")
        with split(tmp_path, text) as system:  # another one takes over, and nothing moves
            assert system.node("camera").pid is None
            system.wait_for_log("found picture")
            assert states(system) == {"active"}
            before = len(found)
            wait_until(lambda: len(found) > before + 10, "messages")
            assert not system.reported(NodeFailed)

            members[0].kill()
            failed = wait_for_failure(system)
            assert failed.reason == "process 'sensing' has not reported for 5 s"
            assert system.node("detector").state == "inactive"
            members[0].wait()
            members[0] = subprocess.Popen([*command_of(path), "--process", "sensing"])
            wait_until(lambda: states(system) == {"active"}, "the return")
        assert all(member.poll() is None for member in members)
    finally:
        for member in members:
            member.send_signal(signal.SIGINT)
        codes = [member.wait(20) for member in members]
    assert codes == [0, 0]


def running_managers(peer: Peer) -> list[str]:
    """Return the manager nodes of processes that are up."""
    names = ("/lab/robot/sensing/manager", "/lab/robot/acting/manager")
    return [name for name in names if peer.node.count_publishers(f"{name}/state")]


def wait_for_failure(system: RunningSystem) -> NodeFailed:
    wait_until(lambda: system.reported(NodeFailed), "the failure")
    wait_until(lambda: system.node("detector").state == "inactive", "the pause")
    return system.reported(NodeFailed)[0]


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
