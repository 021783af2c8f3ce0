"""Requests to another process of a system whose responses are lost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String

from composer.model import ExecutorKind
from composer.runtime.children.child_processes import ChildProcesses
from composer.runtime.executors.sources import EventCounts, Reply
from composer.runtime.manager.member_service import MemberService
from composer.runtime.manager.publishing import ManagerContext, ReportPublisher
from composer.runtime.members import process as member_process
from composer.runtime.members import requests as member_requests
from composer.runtime.members.lives import MemberContext, ProcessUnavailable
from composer.runtime.members.process import MemberProcess
from composer.runtime.members.requests import MemberRequests
from composer.runtime.node.managed_node import RunState
from composer.runtime.node.options import ProcessContext
from composer.runtime.process.instance_lock import hold_instance_lock
from composer.runtime.protocol.codec import ProtocolError
from composer.runtime.protocol.reports import SystemReport
from composer.runtime.protocol.requests import ChangeStates, StepResult, StepResults
from composer.runtime.ros.graph import participant, servers_of
from composer.runtime.ros.service_requests import (
    STATE_QOS,
    RequestService,
    answer_message,
    read_request,
)
from composer.runtime.supervision.status import Status
from tests.ros.support.in_process import system_of, wait_until
from tests.ros.support.loops import Bench, bench

SERVICE = "/robot/acting/manager/request"


class Process:
    """The service of a process. Without ``answers``, its responses are lost."""

    def __init__(self, bench: Bench) -> None:
        self.answers = False
        self.steps: list[str] = []
        self.ids: list[tuple[str, int]] = []
        self.seen: list[int] = []
        self.meant: list[str] = []
        bench.serve(RequestService, SERVICE, self._on_request)

    def _on_request(self, message: RequestService.Request, reply: Reply) -> None:
        request = read_request(message, ChangeStates)
        self.steps += map(str, request.steps)
        self.ids += [(request.sender, step.number) for step in request.steps]
        self.seen.append(request.seen_report)
        self.meant.append(request.participant)
        if self.answers:
            results = (StepResult(success=True, report=1),) * len(request.steps)
            reply(answer_message(StepResults(results)))


def report_of(participant: str, number: int = 1) -> SystemReport:
    return SystemReport(
        name="/robot/acting",
        activity="running",
        nodes=(),
        host="vm",
        pid="7",
        number=number,
        participant=participant,
    )


def requests_of(on: Bench, on_problem: Callable[[str], None]) -> MemberRequests:
    return MemberRequests(
        on.node, on.loop, SERVICE, on_report_key=lambda _: None, on_problem=on_problem
    )


def client(on: Bench, problems: list[str] | None = None) -> MemberRequests:
    requests = requests_of(on, ([] if problems is None else problems).append)
    wait_until(lambda: servers_of(on.node, SERVICE), "the service")
    return requests


@pytest.fixture
def on() -> Iterator[Bench]:
    with bench(ExecutorKind.EVENTS) as running:
        yield running


def test_requests_whose_responses_are_lost_do_not_keep_others_from_being_sent(on: Bench) -> None:
    process = Process(on)
    requests = client(on)
    for number in range(member_requests.MAX_REQUESTS):
        step = f"/node{number}"
        result = on.loop.run(partial(requests.request, step, "activate"))
        wait_until(lambda step=step: f"activate {step}" in process.steps, step)
        result.cancel()  # its node has given up
    process.answers = True
    result = on.loop.run(lambda: requests.request("/last", "activate"))
    wait_until(result.done, "the response")
    assert result.result().success


def test_a_canceled_request_is_not_sent_later(on: Bench) -> None:
    process = Process(on)
    process.answers = True
    requests = client(on)
    requests.hold()
    canceled = on.loop.run(lambda: requests.request("/camera", "activate"))
    canceled.cancel()
    result = on.loop.run(lambda: requests.request("/arm", "activate"))
    requests.release()
    wait_until(result.done, "the response")
    assert process.steps == ["activate /arm"]


@pytest.fixture
def impatience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(member_requests, "AGAIN_AFTER_S", 0.05)


@pytest.mark.usefixtures("impatience")
def test_steps_whose_responses_are_lost_are_requested_again(on: Bench) -> None:
    process, problems = Process(on), list[str]()
    requests = client(on, problems)
    own = participant(servers_of(on.node, SERVICE)[0]).hex()
    on.loop.run(lambda: requests.on_report(report_of(own, 4)))
    requests.hold()
    results = [on.loop.run(partial(requests.request, f"/node{n}", "activate")) for n in (1, 2)]
    requests.release()
    wait_until(lambda: len(process.steps) == 2, "the first request")
    (sender, first), (_, second) = process.ids
    on.loop.run(lambda: requests.on_report(report_of(own, 9)))
    results[0].cancel()  # its node has given up
    wait_until(lambda: len(process.steps) >= 4, "two more requests")
    assert process.steps[:4] == ["activate /node1", *["activate /node2"] * 3]
    assert process.ids[:4] == [(sender, first), *[(sender, second)] * 3]
    assert process.seen[-1] == 9
    process.answers = True
    wait_until(results[1].done, "the response")
    assert results[1].result().success
    assert not problems


def test_a_process_whose_service_is_not_discovered_is_reported(
    on: Bench,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(member_requests, "READY_WITHIN_S", 0.0)
    problems = list[str]()
    requests = requests_of(on, problems.append)
    result = on.loop.run(lambda: requests.request("/arm", "activate"))
    wait_until(lambda: problems, "the report")
    Process(on).answers = True
    wait_until(result.done, "the response")
    assert problems == ["reports, but its service is not discovered; requests wait"]


def test_an_error_of_discovery_does_not_keep_requests_from_being_sent(
    on: Bench,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("no graph")

    Process(on).answers = True
    requests = client(on)
    report = report_of(participant(servers_of(on.node, SERVICE)[0]).hex())
    on.loop.run(lambda: requests.on_report(report))
    with monkeypatch.context() as patched:
        patched.setattr(member_requests, "servers_of", fail)
        result = on.loop.run(lambda: requests.request("/arm", "activate"))
        wait_until(lambda: on.errors() == [RuntimeError], "the error")
    on.loop.run(lambda: requests.on_report(report))
    wait_until(result.done, "the response")
    assert result.result().success


def test_a_process_that_is_not_meant_neither_follows_nor_answers(
    on: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(member_requests, "DISCOVERED_WITHIN_S", 0.0)
    asked: list[str] = []

    def nothing(*_: object) -> Any:
        asked.append("")

    status = Status(system_of("{system: robot, nodes: {leg: {}}}", tmp_path), on.loop.clock)
    context = ManagerContext(
        *(status, "key", nothing, nothing, nothing),
        *(tuple, tuple, dict, nothing, nothing, nothing, nothing),
    )
    unused: Any = None
    process = ProcessContext(on.node, unused, EventCounts(on.loop), unused)
    reports = ReportPublisher(process, on.loop, context, MEANT)
    on.loop.run(reports.publish)
    member = MemberService(on.loop, context, reports, nothing)
    on.serve(
        RequestService,
        SERVICE,
        lambda message, reply: member.on_request(
            read_request(message, ChangeStates),
            lambda answer: reply(answer_message(answer)),
        ),
    )
    requests = client(on)
    on.loop.run(lambda: requests.on_report(report_of(KILLED)))
    others = on.loop.run(lambda: requests.request("/camera", "activate"))
    on.loop.run(lambda: requests.on_report(report_of(MEANT)))
    own = on.loop.run(lambda: requests.request("/camera", "activate"))
    wait_until(own.done, "the response")
    assert own.result().reason == "the process has no such node"
    assert not others.done()
    assert not asked
    others.cancel()


def silent_process(
    on: Bench, folder: Path, *command: str, children: ChildProcesses | None = None
) -> MemberProcess:
    text = "{system: robot, processes: {acting: {nodes: [arm]}}, nodes: {arm: {}, leg: {}}}"
    system = system_of(text, folder)
    context = MemberContext(
        loop=on.loop,
        manager=on.node,
        children=children or ChildProcesses(),
        namespace="/robot",
        command=command,
        write_log=lambda *_: None,
        run_state=RunState(),
    )
    return MemberProcess(system.processes[0], context)


@pytest.mark.parametrize("is_in_the_graph", [True, False])
def test_the_error_says_why_a_process_has_not_reported(
    on: Bench, is_in_the_graph: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(member_process, "STARTS_WITHIN_S", 0.0)
    lock = nullcontext() if is_in_the_graph else hold_instance_lock("/robot/acting")
    with lock:
        process = silent_process(on, tmp_path)
        if is_in_the_graph:
            on.node.create_publisher(String, "/robot/acting/manager/state", STATE_QOS)
        start = on.loop.run_task(process.ensure())
        wait_until(start.done, "the error")
        reason = "its reports do not arrive"
        if not is_in_the_graph:
            reason = "it is not in the ROS graph, and another process holds its instance lock"
        expected = f"process 'acting' has not reported within 0 s: {reason}"
        assert str(start.exception()) == expected
        process.close()


def test_a_process_that_has_not_reported_is_asked_for_nothing(on: Bench, tmp_path: Path) -> None:
    """Another one, of another computer, would follow the request."""
    children = ChildProcesses()
    command = ("sh", "-c", "exec sleep 60", "--")
    process = silent_process(on, tmp_path, *command, children=children)
    start = on.loop.run_task(process.ensure())
    wait_until(lambda: process.pid is not None, "the process")
    with pytest.raises(ProcessUnavailable, match="has not reported yet"):
        process.request("/arm", "shutdown")
    process.end()
    wait_until(start.done, "the error")
    process.close()
    children.close()


MEANT = "11" * 12
KILLED = "00" * 12


@pytest.mark.parametrize("is_discovered", [True, False])
def test_a_request_waits_for_the_service_of_the_process_that_has_reported(
    on: Bench, is_discovered: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not for that of a killed one, nor forever: other middleware may have other ids."""
    monkeypatch.setattr(member_requests, "DISCOVERED_WITHIN_S", 1e6 if is_discovered else 0.1)
    process = Process(on)
    process.answers = True
    requests = client(on)
    on.loop.run(lambda: requests.on_report(report_of(KILLED)))
    result = on.loop.run(lambda: requests.request("/arm", "activate"))
    (server,) = servers_of(on.node, SERVICE)
    own = participant(server).hex()
    if is_discovered:
        on.loop.run(lambda: None)  # what the request has scheduled
        on.loop.run(lambda: requests.on_report(report_of(own)))
    wait_until(result.done, "the response")
    assert process.meant == [own if is_discovered else KILLED]


def test_a_refused_request_says_why(on: Bench) -> None:
    """As by a process of another version."""
    error = ProtocolError("it is of ros2-composer '9.0' (protocol 9)")
    on.serve(RequestService, SERVICE, lambda _, reply: reply(answer_message(error)))
    requests = client(on)
    result = on.loop.run(lambda: requests.request("/arm", "activate"))
    wait_until(result.done, "the response")
    assert result.result() == StepResult(success=False, reason=f"refused: {error}")
