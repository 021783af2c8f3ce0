"""Requests and reports between processes that are lost, arrive twice or late, or are forged."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import TransitionEvent
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.runtime.manager.member_service import ReceivedSteps
from composer.runtime.manager.publishing import ReportTimes
from composer.runtime.protocol.codec import ProtocolError, decode, encode
from composer.runtime.protocol.reports import SystemReport, split_signature
from composer.runtime.protocol.requests import ChangeStates, Step, StepResult
from composer.runtime.ros.service_requests import (
    STATE_QOS,
    RequestService,
    read_answer,
    request_message,
)
from composer.runtime.supervision.events import NodeFailed, Restarted
from tests.ros.members.split_robot import TEXT as ROBOT
from tests.ros.members.split_robot import members, split
from tests.ros.support.in_process import Peer, finished, wait_until
from tests.ros.support.system_process import write_system

TEXT = """
system: robot
namespace: lab
processes: {other: {nodes: [camera]}}
nodes:
  camera: {behavior: busy:Busy, parameters: {folder: ""}, timers: {tick: {period_ms: 20}}}
"""
#: Nothing of Python runs in a process while C holds the interpreter's lock; DDS does.
BUSY = """
import ctypes
from pathlib import Path
from composer.behavior import Behavior

class Busy(Behavior):
    def on_tick(self):
        folder = self.parameters.folder
        if folder and not Path(folder, "busy").exists():
            Path(folder, "busy").touch()
            ctypes.PyDLL(None).usleep(1_500_000)
            Path(folder, "free").touch()
"""
SERVICE = "/lab/robot/other/manager/request"
STATE = "/lab/robot/other/manager/state"


def test_a_request_that_a_full_queue_has_dropped_is_sent_again(tmp_path: Path, peer: Peer) -> None:
    tmp_path.joinpath("busy.py").write_text(BUSY, encoding="utf-8")
    with split(tmp_path, TEXT) as system:
        moves = peer.listen(TransitionEvent, "/lab/camera/transition_event")
        peer.wait_until_known("/lab/camera")
        flood = peer.client(RequestService, SERVICE)
        of_another = request_message(ChangeStates("that of another process", "", 0, ()))
        assert peer.set_parameter("/lab/camera", "folder", str(tmp_path)) == ""
        wait_until(tmp_path.joinpath("busy").exists, "the process")
        pause = peer.begin(Trigger, "/lab/robot/manager/pause")

        def is_free() -> bool:  # the service keeps the last 10 requests that came before
            flood.call_async(of_another)
            return tmp_path.joinpath("free").exists()

        wait_until(is_free, "the end of its work")
        assert finished(pause).success
        wait_until(lambda: labels(moves) == ["deactivating", "inactive"], "the transitions")
        assert not system.reported(NodeFailed)


def test_a_step_that_arrives_twice_or_too_late_is_not_run(tmp_path: Path, peer: Peer) -> None:
    path = write_system(tmp_path, TEXT, busy=BUSY)
    with members(path, "other") as (process,):
        member = peer.listen(String, STATE, STATE_QOS)
        wait_until(lambda: member and last(member).activity == "running", "its nodes")
        moves = peer.listen(TransitionEvent, "/lab/camera/transition_event")
        seen = last(member).number
        configure = Step(1, "configure", "/lab/camera")
        request = ChangeStates("", "peer", seen, (configure,))
        calls = [peer.begin(RequestService, SERVICE, request_message(request)) for _ in range(2)]
        first, second = (read_answer(finished(call), request).results for call in calls)
        assert first[0].success
        assert first == second
        (unknown,) = results(peer, seen, Step(2, "configure", "/lab/arm"))
        assert unknown.reason == "the process has no such node"
        activated, outdated = results(peer, seen, Step(3, "activate", "/lab/camera"), configure)
        assert activated.success
        assert outdated.reason == "a later request was received before"

        # The sender of a late one does not wait any more: it has seen no report for longer.
        wait_until(lambda: last(member).number > seen + 10, "reports of ten seconds")
        for step in (Step(4, "shutdown", "/lab/camera"), Step(5, "deactivate", "/lab/camera")):
            late = ChangeStates("", "peer", seen, (step,))
            peer.client(RequestService, SERVICE).call_async(request_message(late))
        (result,) = results(peer, last(member).number, Step(6, "cleanup", "/lab/camera"))
        assert "the node is active" in result.reason  # requests arrive in order
        wait_until(lambda: len(moves) >= 4, "the transitions")
        assert labels(moves) == ["configuring", "inactive", "activating", "active"]
    assert process.returncode == 0


def last(reports: list[String]) -> SystemReport:
    return decode(split_signature(reports[-1].data)[1], SystemReport)


def results(peer: Peer, seen: int, *steps: Step) -> tuple[StepResult, ...]:
    """Request steps, and return their results."""
    request = ChangeStates("", "peer", seen, steps)
    answer = read_answer(peer.call(RequestService, SERVICE, request_message(request)), request)
    found: tuple[StepResult, ...] = answer.results
    return found


def labels(moves: list[TransitionEvent]) -> list[str]:
    return [move.goal_state.label for move in moves]


FIRST, SECOND = (Step(number, "activate", "/arm") for number in (1, 2))
OF_LEG = Step(1, "activate", "/leg")


def test_a_step_that_arrives_again_is_found() -> None:
    steps = ReceivedSteps[str]()
    assert steps.find("ab", FIRST) is None
    steps.add("ab", FIRST, "configure")
    assert steps.find("ab", FIRST) == "configure"
    assert steps.find("ab", OF_LEG) is None
    assert steps.find("cd", FIRST) is None
    assert steps.of(["/arm", "/leg"]) == ["configure"]


def test_a_step_is_replaced_by_the_next_one_of_its_node_from_the_same_sender() -> None:
    steps = ReceivedSteps[str]()
    assert not steps.is_replaced("ab", FIRST)
    steps.add("ab", SECOND, "activate")
    assert steps.is_replaced("ab", FIRST)
    assert not steps.is_replaced("ab", SECOND)
    assert not steps.is_replaced("ab", OF_LEG)
    assert not steps.is_replaced("cd", FIRST)  # another coordinating process


@pytest.mark.parametrize(
    ("seen", "at_s", "is_outdated"),
    [
        (1, 100.0, False),  # the current one
        (1, 106.0, False),
        (1, 106.5, True),  # the process was stopped since then
        (0, 100.0, True),  # not known, or of another life
    ],
)
def test_a_request_is_as_old_as_the_report_that_its_sender_has_seen(
    seen: int, at_s: float, *, is_outdated: bool
) -> None:
    reports = ReportTimes()
    reports.note(1, 100.0)
    assert reports.is_outdated(seen, at_s) is is_outdated


def test_a_report_that_no_other_has_followed_is_not_old() -> None:
    """Without subscriptions, nothing is published: a new one gets the last report."""
    reports = ReportTimes()
    for second in range(20):
        reports.note(1, 100.0 + second)
    assert not reports.is_outdated(1, 120.0)
    reports.note(2, 120.0)
    assert not reports.is_outdated(1, 121.0)
    reports.note(3, 130.0)
    assert reports.is_outdated(1, 131.0)
    assert reports.is_outdated(2, 131.0)
    assert not reports.is_outdated(3, 131.0)


TOPIC = "/lab/robot/sensing/manager/state"
#: A system in which one process is enough.
SMALL = ROBOT.partition("  detector:")[0].replace("  acting: {}\n", "")


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
    path = write_system(tmp_path, SMALL)
    other = tmp_path / "other"
    other.mkdir()
    with members(path, "sensing", XDG_RUNTIME_DIR=str(other)) as (member,):
        wait_until(lambda: peer.node.count_publishers(TOPIC) == 2, "the process")
        monkeypatch.setattr("tests.ros.members.split_robot.command_of", lambda _: ())
        with split(tmp_path, SMALL) as system:
            assert system.node("camera").state == "active"
            assert system.node("camera").pid is None
            assert f"it is used: host {os.uname().nodename}, process {member.pid}" in (
                system.log_text()
            )
