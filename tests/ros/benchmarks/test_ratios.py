"""Paused programs run only when requested; performance stays within a bound of rclpy's."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, suppress
from pathlib import Path

import pytest

from benchmarks import processes
from benchmarks.figures import ratios
from benchmarks.paused import PausedPrograms
from benchmarks.processes import ProgramFailed
from benchmarks.rounds import COMPOSED, SINGLE, Case, rows, run_rounds
from benchmarks.systems import cpu_us
from tests.ros.support.in_process import wait_until

RING = ("bare_external", "none", "--shape", "ring", "--nodes", "2", "--seconds", "1")
BOTH = tuple((*RING, "--part", part) for part in "01")
STOPPED = "T"

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(180)]


def states_of_children() -> dict[int, str]:
    """Return the scheduler state of each child process; see proc_pid_stat(5).

    Processes may exit while /proc is read.
    """
    states = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(FileNotFoundError, ProcessLookupError):
            state, parent = file.read_text().rpartition(")")[2].split()[:2]
            if int(parent) == os.getpid():
                states[int(file.parent.name)] = state
    return states


def test_programs_run_only_when_requested() -> None:
    before = states_of_children().keys()

    def states() -> list[str]:
        return [state for process, state in states_of_children().items() if process not in before]

    with PausedPrograms(BOTH, os.environ, timeout_s=60.0) as held:
        wait_until(lambda: states() == [STOPPED, STOPPED], "both stopped")
        held.work(2.0)
        wait_until(lambda: states() == [STOPPED, STOPPED], "both stopped again")
        result = held.result()
    assert result["delivered"] > 0
    assert not states()


@pytest.mark.parametrize(
    ("parts", "timeout_s", "message"),
    [
        pytest.param(BOTH, 0.01, "not started within 0.01 s", id="late"),
        pytest.param(
            [("bare", "none", "--shape", "bow")], 20.0, "exit code 2: .*invalid choice", id="bad"
        ),
    ],
)
def test_programs_that_do_not_start_are_reported_and_killed(
    parts: tuple[tuple[str, ...], ...], timeout_s: float, message: str
) -> None:
    before = states_of_children().keys()
    with pytest.raises(ProgramFailed, match=message), PausedPrograms(parts, os.environ, timeout_s):
        pytest.fail("has started")
    assert states_of_children().keys() == before


ROUNDS = 6


@pytest.fixture(autouse=True)
def apart_from_other_tests(
    monkeypatch: pytest.MonkeyPatch, in_a_domain: Callable[[], AbstractContextManager[int]]
) -> Iterator[None]:
    """Use ROS domains that no other test uses."""
    with ExitStack() as domains:
        ids = (domains.enter_context(in_a_domain()) for _ in itertools.count())
        monkeypatch.setattr(processes, "domain_ids", ids)
        yield


@pytest.mark.parametrize(
    ("shape", "nodes", "bound"),
    [
        pytest.param("ring", 10, 0.008, id="messages"),  # measured: 0.003; through DDS: 0.015
        pytest.param("service", 3, 0.04, id="services"),  # measured: 0.015
    ],
)
def test_cpu_stays_within_a_bound(shape: str, nodes: int, bound: float) -> None:
    case = Case(shape, nodes, seconds=0.3, rounds=1)
    measured: list[float] = []  # without rounds in which rclpy hung
    for _ in range(ROUNDS):
        (row,) = rows(shape, "CPU us", run_rounds((COMPOSED, SINGLE), case), cpu_us)
        measured += ratios(row)
        if measured and measured[-1] < bound:
            return
    pytest.fail(f"above the bound of {bound} in each of {ROUNDS} rounds: {measured}")
