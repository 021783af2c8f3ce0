"""Reports of a process that another node publishes, or publishes again: they decide nothing."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String

from composer.runtime.protocol.codec import ProtocolError, decode, encode
from composer.runtime.protocol.reports import SystemReport, split_signature
from composer.runtime.ros.manager_interface import STATE_QOS
from composer.runtime.supervision.events import NodeFailed, Restarted
from tests.ros.members.split_robot import TEXT, command_of, split
from tests.ros.support.in_process import Peer, wait_until

TOPIC = "/lab/robot/sensing/manager/state"
#: A system in which one process is enough.
SMALL = TEXT.partition("  detector:")[0].replace("  acting: {}\n", "")


def changed(text: str, state: dict[str, Any] | None = None, **values: Any) -> str:
    """Return a report with its signature and other values of the process and its nodes."""
    signature, document = split_signature(text)
    report = decode(document, SystemReport)
    nodes = tuple(replace(node, **(state or {})) for node in report.nodes)
    return signature + encode(replace(report, **{"nodes": nodes, **values}))


def of_another_run(text: str) -> str:
    identity = {"pid": "99", "host": "robot7", "started_s": 1.7e9, "participant": "00" * 12}
    return changed(text, is_child=False, number=5, **identity)


def with_many_nodes(text: str) -> str:
    (node,) = decode(split_signature(text)[1], SystemReport).nodes
    return changed(text, nodes=tuple(replace(node, node=f"/n{i}") for i in range(200)))


FORGERIES: tuple[Callable[[str], str], ...] = (
    of_another_run,
    with_many_nodes,
    lambda text: changed(text, activity="stopping", number=999999),
    lambda text: changed(text, {"state": "inactive"}, number=999999),
    lambda text: changed(text, {"held_down": "\x1b[31mforged\n"}, number=999999),
    lambda text: changed(of_another_run(text), started_s=9e9, number=999999),
    lambda text: split_signature(text)[1],
    lambda text: text,  # as it was, later
)


def test_forged_and_replayed_reports_decide_nothing(tmp_path: Path, peer: Peer) -> None:
    publisher = peer.node.create_publisher(String, TOPIC, STATE_QOS)
    forged = SystemReport("robot", "running", (), "robot7", "99", started_s=1.0, number=5)
    publisher.publish(String(data=encode(forged)))
    with split(tmp_path, SMALL) as system:  # the latched one comes before the process starts
        camera = system.node("camera")
        pid = camera.pid
        assert pid is not None
        reports = peer.listen(String, TOPIC, STATE_QOS)
        wait_until(lambda: any(is_of(report, pid) for report in reports), "a report")
        report = next(report.data for report in reports if is_of(report, pid))
        for forge in FORGERIES:
            publisher.publish(String(data=forge(report)))
        reports.clear()
        wait_until(lambda: sum(is_of(later, pid) for later in reports) > 1, "reports after them")
        assert (camera.state, camera.pid) == ("active", pid)
        assert system.states("/lab/camera")[-1] == "/lab/camera active"
        assert not system.reported(NodeFailed)

        publisher.publish(String(data=of_another_run(report)))
        os.kill(pid, signal.SIGKILL)
        publisher.publish(String(data=of_another_run(report)))
        wait_until(lambda: system.reported(Restarted), "the restart")
        assert camera.pid not in (pid, None)


def is_of(message: String, pid: int) -> bool:
    try:
        return decode(split_signature(message.data)[1], SystemReport).pid == str(pid)
    except ProtocolError:
        return False


def test_a_process_of_another_computer_is_known_by_its_service(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The coordinating process cannot read its instance lock, and asks it for its key."""
    publisher = peer.node.create_publisher(String, TOPIC, STATE_QOS)
    publisher.publish(String(data="robot"))
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
