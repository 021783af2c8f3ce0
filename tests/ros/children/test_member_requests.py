"""Requests to another process of a system whose responses are lost."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import pytest
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters

from composer.model import ExecutorKind
from composer.runtime.children import member_process, member_requests
from composer.runtime.children.child_processes import Child, ChildProcesses
from composer.runtime.children.kept_goals import KeptGoals
from composer.runtime.children.member_context import MemberContext, ProcessUnavailable
from composer.runtime.children.member_process import MemberProcess
from composer.runtime.children.member_requests import MemberRequests
from composer.runtime.executors.loop import Reply
from composer.runtime.manager.member_service import MemberCallbacks, MemberService
from composer.runtime.ros.graph import participant, servers_of
from composer.runtime.ros.manager_protocol import CHANGE_STATES, FIGURES, GOALS
from tests.ros.support.in_process import system_of, wait_until
from tests.ros.support.loops import Bench, bench

SERVICE = "/robot/acting/manager/change_states"


class Process:
    """The service of a process. Without ``answers``, its responses are lost."""

    def __init__(self, bench: Bench) -> None:
        self.answers = False
        self.steps: list[str] = []
        self.goals: list[str] = []
        self.asked = 0
        bench.serve(SetParameters, SERVICE, self._on_request)

    def _on_request(self, request: SetParameters.Request, reply: Reply) -> None:
        names = [parameter.name for parameter in request.parameters]
        steps = request.parameters[0].value.string_array_value
        self.steps += steps
        self.asked += FIGURES in names
        self.goals += [item.value.string_value for item in request.parameters if item.name == GOALS]
        if self.answers:
            results = [SetParametersResult(successful=True, reason="1") for _ in steps]
            results += [SetParametersResult(reason="[]")] * (FIGURES in names)
            reply(SetParameters.Response(results=results))


def client(on: Bench, figures: list[str]) -> MemberRequests:
    requests = MemberRequests(on.node, on.loop, SERVICE, figures.append)
    wait_until(requests._client.service_is_ready, "the service")
    return requests


def test_requests_whose_responses_are_lost_do_not_keep_others_from_being_sent() -> None:
    with bench(ExecutorKind.EVENTS) as on:
        process = Process(on)
        requests = client(on, [])
        for number in range(member_requests._MAX_REQUESTS):
            step = f"/node{number}"
            result = on.loop.run(partial(requests.request, step, "activate"))
            wait_until(lambda step=step: f"activate {step}" in process.steps, step)
            result.cancel()  # its node has given up
        process.answers = True
        result = on.loop.run(lambda: requests.request("/last", "activate"))
        wait_until(result.done, "the response")
        assert result.result().successful


def test_a_canceled_request_is_not_sent_later() -> None:
    with bench(ExecutorKind.EVENTS) as on:
        process = Process(on)
        process.answers = True
        requests = client(on, [])
        requests.hold()
        canceled = on.loop.run(lambda: requests.request("/camera", "activate"))
        canceled.cancel()
        result = on.loop.run(lambda: requests.request("/arm", "activate"))
        requests.release()
        wait_until(result.done, "the response")
        assert process.steps == ["activate /arm"]


def test_lost_goals_are_sent_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(member_requests, "_ANSWERED_WITHIN_S", 0.05)
    with bench(ExecutorKind.EVENTS) as on:
        process = Process(on)
        requests = client(on, [])

        def is_kept_twice() -> bool:
            on.loop.run(lambda: requests.keep("1 running active"))  # as each report asks for it
            return len(process.goals) >= 2

        wait_until(is_kept_twice, "the goals")
        wait_until(lambda: not requests.has_messages, "the end of the wait")


def test_timings_and_goals_need_no_steps() -> None:
    with bench(ExecutorKind.EVENTS) as on:
        process, figures = Process(on), list[str]()
        process.answers = True
        requests = client(on, figures)
        requests.hold()
        on.loop.run(requests.ask_for_figures)
        on.loop.run(lambda: requests.keep("1 stopped active"))
        assert requests.has_messages
        requests.release()
        wait_until(lambda: figures == ["[]"], "the timings")
        assert not requests.has_messages
        assert (process.goals, process.asked, process.steps) == (["1 stopped active"], 1, [])


def test_a_process_that_is_not_meant_neither_follows_nor_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(member_requests, "_DISCOVERED_WITHIN_S", 0.0)
    asked: list[str] = []

    def nothing(*_: object) -> Any:
        asked.append("")

    with bench(ExecutorKind.EVENTS) as on:
        callbacks = MemberCallbacks(dict, *[nothing] * 6)
        MemberService(on.node, on.loop, callbacks, MEANT)
        service = on.node.resolve_service_name(f"~/{CHANGE_STATES}")
        requests = MemberRequests(on.node, on.loop, service, nothing)
        on.loop.run(lambda: requests.on_report(KILLED, "goals"))
        others = on.loop.run(lambda: requests.request("/camera", "activate"))
        on.loop.run(lambda: requests.on_report(MEANT, None))
        own = on.loop.run(lambda: requests.request("/camera", "activate"))
        wait_until(own.done, "the response")
        assert own.result().reason == "the process has no such node"
        assert not others.done()
        assert not asked
        others.cancel()


def test_a_process_that_has_not_reported_is_asked_for_nothing(tmp_path: Path) -> None:
    """Another one, of another computer, would follow the request."""
    text = "{system: robot, processes: {acting: {nodes: [arm]}}, nodes: {arm: {}, leg: {}}}"
    system = system_of(text, tmp_path)
    with bench(ExecutorKind.EVENTS) as on:
        context = MemberContext(
            loop=on.loop,
            manager=on.node,
            children=ChildProcesses(),
            namespace="/robot",
            command=("unused",),
            goals=KeptGoals(system),
            write_log=lambda *_: None,
        )
        process = MemberProcess(system.processes[0], context)
        process._life = member_process._Life(child=Child(1))
        with pytest.raises(ProcessUnavailable, match="has not reported yet"):
            process.request("/arm", "shutdown")
        process.close()


MEANT = "11" * 12
KILLED = "00" * 12


@pytest.mark.parametrize("is_discovered", [True, False])
def test_a_request_waits_for_the_service_of_the_process_that_has_reported(
    is_discovered: bool,
) -> None:
    """Not for that of a killed one, nor forever: other middleware may have other ids."""
    with bench(ExecutorKind.EVENTS) as on:
        process = Process(on)
        process.answers = True
        requests = client(on, [])
        on.loop.run(lambda: requests.on_report(KILLED, None))
        result = on.loop.run(lambda: requests.request("/arm", "activate"))
        assert not on.loop.run(requests._is_ready)
        assert not requests._sent
        if is_discovered:
            (server,) = servers_of(on.node, SERVICE)
            on.loop.run(lambda: requests.on_report(participant(server).hex(), "1 running active"))
        else:
            requests._awaited_until_s = 0.0
        wait_until(result.done, "the response")
        wait_until(lambda: not requests.has_messages, "the response to the goals")
        assert process.goals == ["1 running active"] * is_discovered
