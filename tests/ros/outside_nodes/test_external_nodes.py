"""External nodes: awaited, observed, and never ended by the system."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from lifecycle_msgs.srv import GetState

from composer.runtime.host_options import HostOptions
from composer.runtime.manager.other_instances import Instance
from composer.runtime.supervision.events import BroughtUp, NodeFailed, RollingBack
from tests.ros.support.external_processes import soon_missed
from tests.ros.support.forked import ForkedProgram
from tests.ros.support.in_process import Peer, running, wait_until

PROGRAMS = Path(__file__).parents[1] / "programs"
EXTERNAL = """
system: robot
nodes:
  lidar:
    external: {ready_timeout_ms: TIMEOUT}
    publishers: {scan: {type: std_msgs/msg/String}}
    services: {reset: {type: std_srvs/srv/Trigger}}
  filter:
    lifecycle: {depends_on: [lidar]}
    subscriptions: {scan: {type: std_msgs/msg/String, log: "{message.data}"}}
"""


@contextmanager
def external_lidar(folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run the external node for the length of the block."""
    names = ("-r", "__node:=lidar", "-r", "words:=scan", "-p", "rate:=20.0")
    process = subprocess.Popen(
        [sys.executable, PROGRAMS / "driver.py", "--ros-args", *names],
        env={**os.environ, **soon_missed(folder)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def test_an_external_node_is_awaited_and_observed(tmp_path: Path) -> None:
    text = EXTERNAL.replace("TIMEOUT", "20000")
    with external_lidar(tmp_path) as process, running(text, tmp_path) as system:
        assert system.states()[-2:] == ["/lidar active", "/filter active"]
        system.wait_for_log("tick")
        process.send_signal(signal.SIGINT)
        process.wait(60)
        failed = system.wait_for_failure("/lidar")
        assert failed.reason == "it has disappeared from the ROS graph"
        wait_until(lambda: system.node("filter").state == "inactive", "the pause")
        with external_lidar(tmp_path) as next_process:
            wait_until(lambda: system.node("filter").state == "active", "the return")
            system.stop()
            assert next_process.poll() is None  # never ended by the system


@pytest.mark.parametrize("is_required", [True, False])
def test_a_system_is_up_without_an_external_node_and_takes_it_in_later(
    is_required: bool, tmp_path: Path
) -> None:
    text = EXTERNAL.replace("TIMEOUT", "300") + "  other: {}\n"
    if not is_required:
        text = text.replace("  lidar:\n", "  lidar:\n    required: false\n")
    with running(text, tmp_path) as system:
        (up,) = system.reported(BroughtUp)
        assert str(up).startswith("1 of 3 nodes active after ")
        assert str(up).endswith(" s, waiting for /lidar")
        assert up.is_complete is not is_required
        failed = system.wait_for_failure("/lidar")
        missing = "it has no publisher /scan, service /reset after 0.3 s"
        assert failed.reason.startswith(f"activate failed: {missing}")
        assert failed.is_tolerated is not is_required
        assert [system.node(name).state for name in ("other", "filter")] == ["active", "inactive"]
        with external_lidar(tmp_path):
            wait_until(lambda: system.node("filter").state == "active", "the arrival")
            assert system.reported(NodeFailed) == [failed]
            assert system.stop().exit_code == 0


def test_the_end_does_not_wait_for_an_absent_node(tmp_path: Path) -> None:
    text = EXTERNAL.replace("TIMEOUT", "60000").replace(
        "  lidar:\n", "  lidar:\n    required: false\n"
    )
    with running(text, tmp_path) as system:
        wait_until(lambda: system.node("lidar").state == "activating", "the wait for it")
        outcome = system.stop()
        assert outcome.exit_code == 0
        assert [node.state for node in outcome.nodes] == ["finalized"] * 2
        assert outcome.remarks == ("waiting for /lidar",)


ELSEWHERE = """
system: robot
nodes: {lidar: {name: NAME, namespace: elsewhere, external: {ready_timeout_ms: 5000}}}
"""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            EXTERNAL.replace("TIMEOUT", "300"),
            "no publisher /scan, service /reset after 0.3 s; start",
        ),
        (ELSEWHERE, "ROS graph after 5 s; there is /NAME instead: write 'namespace: /'"),
    ],
)
def test_an_absent_external_node_fails_a_bring_up_that_is_all_or_nothing(
    text: str, reason: str, tmp_path: Path, peer: Peer
) -> None:
    name = peer.node.get_name()
    options = HostOptions(all_or_nothing=True)
    with running(text.replace("NAME", name), tmp_path, options=options) as system:
        assert system.end().exit_code == 1
    assert reason.replace("NAME", name) in str(system.reported(RollingBack)[0])


def test_a_refused_system_leaves_an_external_node_as_it_is(tmp_path: Path, peer: Peer) -> None:
    """Another computer runs the system already, with the same node."""
    text = "{system: robot, nodes: {some_managed_driver: {external: {lifecycle: managed}}}}"
    state = "/some_managed_driver/get_state"
    with ForkedProgram(PROGRAMS / "managed_driver.py") as process:
        try:
            with running(text, tmp_path) as system:
                assert peer.call(GetState, state).current_state.label == "active"
                older = Instance("elsewhere", 4321, 3600.0)
                system.host.on_older_instance("/robot", older)
                assert "already runs" in system.end().reason
                assert peer.call(GetState, state).current_state.label == "active"
        finally:
            process.kill()
