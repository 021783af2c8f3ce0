"""Which steps of a plan are started when, without ROS and nodes."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import pytest

from composer.plan import Step
from composer.runtime.executors.futures import Future
from composer.runtime.supervision.phases import (
    ExecutionOptions,
    Phase,
    RunningStep,
    wait_for_step,
)


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


def phase_of(waiting: deque[Step], processes: Mapping[str, str], *, down: bool = True) -> Phase:
    return Phase(waiting, ExecutionOptions(best_effort=down), processes)


def test_a_process_gets_a_chain_of_its_nodes_at_once() -> None:
    processes = {f"n{number}": "other" for number in range(1, 5)}
    phase = phase_of(steps((), (1,), (2,), (1, 3)), processes)
    assert started(phase) == [(1, ()), (2, (1,)), (3, (2,)), (4, (1, 3))]


def test_a_step_waits_here_for_nodes_of_another_process() -> None:
    processes = {"n1": "left", "n2": "right", "n3": "right"}
    phase = phase_of(steps((), (1,), (2,)), processes)
    assert started(phase) == [(1, ())]
    phase.running.clear()
    phase.done.add(1)
    assert started(phase) == [(2, ()), (3, (2,))]


def test_a_later_request_waits_for_a_step_of_an_earlier_one() -> None:
    processes = {"n1": "left", "n2": "right", "n3": "left"}
    phase = phase_of(steps((), (), (1, 2)), processes)
    assert started(phase) == [(1, ()), (2, ())]
    del phase.running[2]
    phase.done.add(2)
    assert started(phase) == [(3, (1,))]


def test_nodes_of_this_process_wait_here() -> None:
    phase = phase_of(steps((), (1,)), {})
    assert started(phase) == [(1, ())]
    assert started(phase) == []


def test_all_or_nothing_plans_wait_here_for_each_success() -> None:
    phase = phase_of(steps((), (1,)), {"n1": "other", "n2": "other"}, down=False)
    assert started(phase) == [(1, ())]


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
