"""Reports of a process that another node publishes, or publishes again: they decide nothing."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from composer.runtime.ros.manager_protocol import STATE_QOS
from composer.runtime.supervision.events import NodeFailed, Restarted
from tests.ros.members.split_robot import TEXT, command_of, split
from tests.ros.support.in_process import Peer, wait_until

TOPIC = "/lab/robot/sensing/manager/state"
#: A system in which one process is enough.
SMALL = TEXT.partition("  detector:")[0].replace("  acting: {}\n", "")


def changed(report: DiagnosticArray, **values: str) -> DiagnosticArray:
    """Return a report with other values of the process and its nodes."""
    forged = deepcopy(report)
    for status in forged.status:
        for item in status.values:
            item.value = values.get(item.key, item.value)
    return forged


def of_another_run(report: DiagnosticArray) -> DiagnosticArray:
    identity = {"pid": "99", "host": "robot7", "started": "1700000000.5", "participant": "00" * 12}
    return changed(report, is_child="false", number="5", **identity)


def with_many_nodes(report: DiagnosticArray) -> DiagnosticArray:
    forged = changed(report)
    values = forged.status[1].values
    forged.status += [DiagnosticStatus(name=f"x: /n{i}", values=values) for i in range(200)]
    return forged


FORGERIES: tuple[Callable[[DiagnosticArray], DiagnosticArray], ...] = (
    of_another_run,
    with_many_nodes,
    lambda report: changed(report, activity="stopping", number="999999"),
    lambda report: changed(report, state="inactive", number="999999"),
    lambda report: changed(report, held_down="\x1b[31mforged\n", number="999999"),
    lambda report: changed(of_another_run(report), started="9e9", number="999999"),
    deepcopy,  # as it was, later
)


def test_forged_and_replayed_reports_decide_nothing(tmp_path: Path, peer: Peer) -> None:
    publisher = peer.node.create_publisher(DiagnosticArray, TOPIC, STATE_QOS)
    values = {"activity": "running", "host": "robot7", "pid": "99", "started": "1", "number": "5"}
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    publisher.publish(DiagnosticArray(status=[DiagnosticStatus(name="robot", values=pairs)]))
    with split(tmp_path, SMALL) as system:  # the latched one comes before the process starts
        camera = system.node("camera")
        pid = camera.pid
        assert pid is not None
        reports = peer.listen(DiagnosticArray, TOPIC, STATE_QOS)
        wait_until(lambda: any(is_of(report, pid) for report in reports), "a report")
        report = next(report for report in reports if is_of(report, pid))
        for forge in FORGERIES:
            publisher.publish(forge(report))
        reports.clear()
        wait_until(lambda: sum(is_of(later, pid) for later in reports) > 1, "reports after them")
        assert (camera.state, camera.pid) == ("active", pid)
        assert system.states("/lab/camera")[-1] == "/lab/camera active"
        assert not system.reported(NodeFailed)

        publisher.publish(of_another_run(report))
        os.kill(pid, signal.SIGKILL)
        publisher.publish(of_another_run(report))
        wait_until(lambda: system.reported(Restarted), "the restart")
        assert camera.pid not in (pid, None)


def is_of(report: DiagnosticArray, pid: int) -> bool:
    return any(item.key == "pid" and item.value == str(pid) for item in report.status[0].values)


def test_a_process_of_another_computer_is_known_by_its_service(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The coordinating process cannot read its instance lock, and asks it for its key."""
    publisher = peer.node.create_publisher(DiagnosticArray, TOPIC, STATE_QOS)
    publisher.publish(DiagnosticArray(status=[DiagnosticStatus(name="robot")]))
    path = tmp_path / "robot.yaml"
    path.write_text(SMALL, encoding="utf-8")
    other = tmp_path / "other"
    other.mkdir()
    member = subprocess.Popen(
        [*command_of(path), "--process", "sensing"],
        env={**os.environ, "XDG_RUNTIME_DIR": str(other)},
        stderr=subprocess.DEVNULL,
    )
    try:
        wait_until(lambda: peer.node.count_publishers(TOPIC) == 2, "the process")
        monkeypatch.setattr("tests.ros.members.split_robot.command_of", lambda _: ())
        with split(tmp_path, SMALL) as system:
            assert system.node("camera").state == "active"
            assert system.node("camera").pid is None
            assert f"it is used: host {os.uname().nodename}, process {member.pid}" in (
                system.log_text()
            )
    finally:
        member.send_signal(signal.SIGINT)
        member.wait(30)
