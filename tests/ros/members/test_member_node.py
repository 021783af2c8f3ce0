"""Nodes of another process: what their reports say, and their counters over its lives."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from composer.model import ExecutorKind, LogLevel
from composer.runtime.executors.futures import Future
from composer.runtime.members import node as member_node
from composer.runtime.members.lives import NodeFigures, ProcessUnavailable
from composer.runtime.members.node import MemberNode
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.managed_node import RunState, TransitionOutcome
from composer.runtime.outside_nodes.outside_node import OutsideContext
from composer.runtime.protocol.reports import NodeReport
from composer.runtime.protocol.requests import StepResult
from tests.ros.members.split_robot import DETECTOR, TEXT
from tests.ros.support.in_process import system_of, wait_until
from tests.ros.support.loops import Bench, bench


class Process:
    """A process that runs, and does what is requested."""

    moved_s = 0.0
    pid = 1

    def __init__(self) -> None:
        self.killed = ""

    def add(self, _: object) -> None:
        pass

    async def ensure(self) -> None:
        pass

    async def kill(self, reason: str) -> None:
        self.killed = reason
        raise ProcessUnavailable(reason)

    def request(self, *_: object) -> Future[StepResult]:
        done: Future[StepResult] = Future()
        done.set_result(StepResult(success=True, report=1))
        return done


class Listener:
    """Keeps what the node reports."""

    def __init__(self) -> None:
        self.events: list[str] = []

    def on_ended(self, *_: object, **__: object) -> None:
        self.events.append("ended")

    def on_transition_end(self, outcome: TransitionOutcome) -> None:
        self.events.append(f"{outcome.transition} {outcome.state}")

    def on_returned(self) -> None:
        self.events.append("returned")


def failed_node(on: Bench, process: Any, folder: Path, listener: Any) -> MemberNode:
    """Return a node that has failed, and that its process has not taken down yet."""
    model = next(n for n in system_of(TEXT, folder, detector=DETECTOR).nodes if n.process)
    nothing: Any = None
    context = OutsideContext(
        *(on.loop, listener, Statistics(), 20.0, RunState(), nothing, nothing),
        *(LogLevel.INFO, {}),
    )
    node = MemberNode(model, process, context)
    report(on, node, "active")
    return node


def reported(state: str, held_down: str = "") -> NodeReport:
    return NodeReport("/lab/camera", "active", state=state, held_down=held_down)


def report(on: Bench, node: MemberNode, state: str) -> None:
    on.loop.run(lambda: node.on_report(reported(state, "silent for 1 s")))


@contextmanager
def restart_of_failed_node(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Bench, MemberNode, Process, Future[Any]]]:
    """Restart a failed node whose reports are late from the beginning."""
    monkeypatch.setattr(member_node, "REPORTED_WITHIN_S", 0.0)
    with bench(ExecutorKind.EVENTS) as on:
        process = Process()
        node = failed_node(on, process, folder, Listener())
        yield on, node, process, on.loop.run_task(node.run_step("configure", lambda: False))


@pytest.mark.parametrize("is_taken_down", [False, True])
def test_a_node_hangs_only_if_late_reports_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_taken_down: bool
) -> None:
    with restart_of_failed_node(tmp_path, monkeypatch) as (on, node, process, restart):
        report(on, node, "active")  # the process was busy; this one may be older
        on.loop.run(lambda: None)
        assert not process.killed
        report(on, node, "unconfigured" if is_taken_down else "active")
        wait_until(restart.done, "the end of the restart")
        assert process.killed == ("" if is_taken_down else "/lab/camera hangs")
        assert restart.result().success is is_taken_down


class CutOff(Process):
    """A process that is lost with the first request, and receives it later."""

    is_absent = False

    def request(self, *_: object) -> Future[StepResult]:
        lost: Future[StepResult] = Future()
        lost.set_exception(ProcessUnavailable("process 'sensing' has not reported for 5 s"))
        return lost


def test_a_request_that_arrives_after_a_cut_is_not_that_of_a_user(tmp_path: Path) -> None:
    with bench(ExecutorKind.EVENTS) as on:
        listener = Listener()
        node = failed_node(on, CutOff(), tmp_path, listener)
        on.loop.run(lambda: node.on_report(reported("active")))
        on.loop.run(node.take_over)
        pause = on.loop.run_task(node.run_step("deactivate", lambda: False))
        wait_until(pause.done, "the end of the request")
        on.loop.run(lambda: node.on_report(reported("active")))
        on.loop.run(node.take_over)
        events = listener.events
        events.clear()
        on.loop.run(lambda: node.on_report(reported("inactive")))
        assert events == ["return inactive", "returned"]  # and a plan activates it
        events.clear()
        on.loop.run(lambda: node.on_report(reported("active")))
        on.loop.run(lambda: node.on_report(reported("inactive")))
        assert events == ["activate active", "deactivate inactive"]  # now it is one


def counted(errors: int, sent: int, host: str = "") -> NodeReport:
    return NodeReport("/a", "active", errors=errors, sent={"/a": sent}, sent_hz=1.0, host=host)


@pytest.mark.parametrize(
    ("is_started_here", "first", "counts"),
    [
        pytest.param(True, [(2, 10)], [(2, 10), (3, 14)], id="counts go on"),
        pytest.param(False, [(5, 100), (6, 101)], [(1, 1), (2, 5)], id="of an earlier run"),
    ],
)
def test_counts_of_this_run_go_on_over_the_lives_of_a_process(
    is_started_here: bool, first: list[tuple[int, int]], counts: list[tuple[int, int]]
) -> None:
    figures = NodeFigures()
    for errors, sent in first:
        figures.take(counted(errors, sent), "vm", is_started_here=is_started_here)
    assert figures.current["errors"] == first[-1][0]
    seen = [(figures.since_start["errors"], figures.since_start["sent"])]
    figures.end_life()
    figures.take(counted(1, 4), "vm", is_started_here=is_started_here)  # a new process
    seen.append((figures.since_start["errors"], figures.since_start["sent"]))
    assert seen == counts


def test_the_host_is_that_of_the_process_unless_the_node_has_another_one() -> None:
    figures = NodeFigures()
    for host, expected in (("", "vm"), ("arm", "arm")):
        figures.take(counted(0, 0, host), "vm", is_started_here=True)
        assert figures.current["host"] == expected
