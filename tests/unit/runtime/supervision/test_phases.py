"""Which steps of a plan are started when, without ROS and nodes."""

from __future__ import annotations

from collections import deque
from typing import Any

import pytest

from composer.plan import Step
from composer.runtime.executors.futures import Future
from composer.runtime.supervision.phases import ExecutionOptions, Phase, RunningStep, wait_for_step


def steps(*after: tuple[int, ...]) -> deque[Step]:
    """Return steps of nodes ``n1``, ``n2`` ..., each with the numbers that it waits for."""
    numbered = enumerate(after, start=1)
    return deque(
        Step(number, "deactivate", f"n{number}", f"/n{number}", "", waits)
        for number, waits in numbered
    )


def started(phase: Phase) -> list[tuple[int, tuple[int, ...]]]:
    """Start what can start; return the numbers, each with what its process waits for before it."""
    ready = phase.take_ready()
    for step, _ in ready:
        phase.running[step.number] = RunningStep(step, "", None, 0.0, 0.0, 0.0)
    return [(step.number, tuple(other.number for other in after)) for step, after in ready]


ONE = [(1, ())]


@pytest.mark.parametrize(
    ("after", "processes", "best_effort", "first", "ended", "then"),
    [
        pytest.param(
            *([(), (1,), (2,), (1, 3)], "oooo", True),
            *([(1, ()), (2, (1,)), (3, (2,)), (4, (1, 3))], (), []),
            id="a process gets a chain of its nodes at once",
        ),
        pytest.param(
            *([(), (1,), (2,)], "lrr", True, ONE, (1,), [(2, ()), (3, (2,))]),
            id="a step waits here for nodes of another process",
        ),
        pytest.param(
            *([(), (), (1, 2)], "lrl", True, [(1, ()), (2, ())], (2,), [(3, (1,))]),
            id="a later request waits for a step of an earlier one",
        ),
        pytest.param([(), (1,)], "", True, ONE, (), [], id="nodes of this process wait here"),
        pytest.param([(), (1,)], "oo", False, ONE, (), [], id="all or nothing: each success"),
    ],
)
def test_steps_are_started_as_soon_as_their_process_can_order_them(
    after: list[tuple[int, ...]],
    processes: str,
    best_effort: bool,
    first: list[tuple[int, tuple[int, ...]]],
    ended: tuple[int, ...],
    then: list[tuple[int, tuple[int, ...]]],
) -> None:
    of_nodes = {f"n{number}": process for number, process in enumerate(processes, start=1)}
    phase = Phase(steps(*after), ExecutionOptions(best_effort=best_effort), of_nodes)
    assert started(phase) == first
    for number in ended:
        del phase.running[number]
        phase.done.add(number)
    assert started(phase) == then


class SuspendedQueue:
    """A queue and its clock, which only ``wait`` advances, which suspends the process once."""

    urgent = stopping = False

    def __init__(self, suspended_s: float) -> None:
        self.now_s = 100.0
        self._suspended_s = suspended_s

    @property
    def clock(self) -> SuspendedQueue:
        return self

    def monotonic(self) -> float:
        return self.now_s

    def wait(self, _: object, until_s: float, *, stoppable: bool) -> bool:
        self.now_s = max(self.now_s, until_s) + self._suspended_s
        self._suspended_s = 0.0
        return False


@pytest.mark.parametrize("suspended_s", [0.0, 0.05, 3.0])
def test_a_suspended_process_has_as_much_time_as_any(suspended_s: float) -> None:
    main_queue: Any = SuspendedQueue(suspended_s)
    (step,) = steps(())
    options = ExecutionOptions(best_effort=True, stoppable=False, end_s=101.7)
    phase = Phase(deque(), options, {})
    item = RunningStep(step, "", Future(), 100.0, 1.0, options.end_s)
    phase.running[1] = item
    phase.check_s = item.until_s
    wait_for_step(phase, main_queue)
    lost_s = suspended_s if suspended_s > 0.1 else 0.0
    assert main_queue.now_s == pytest.approx(101.0 + lost_s)
    assert item.until_s == phase.check_s == pytest.approx(101.0 + lost_s)
    assert phase.options.end_s == item.end_s == pytest.approx(101.7 + lost_s)
