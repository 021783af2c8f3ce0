"""Which steps of a plan are started when, without ROS and nodes."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from composer.plan import Step
from composer.runtime.supervision.plan_executor import ExecutionOptions, _Phase, _RunningStep


def steps(*after: tuple[int, ...]) -> deque[Step]:
    """Return steps of nodes ``n1``, ``n2`` ..., each with the numbers that it waits for."""
    numbered = enumerate(after, start=1)
    return deque(
        Step(number, "deactivate", f"n{number}", f"/n{number}", "", waits)
        for number, waits in numbered
    )


def started(phase: _Phase) -> list[tuple[int, tuple[int, ...]]]:
    """Start what can start; return the numbers, each with what its process waits for before it."""
    ready = phase.take_ready()
    for step, _ in ready:
        phase.running[step.number] = _RunningStep(step, "", None, 0.0, 0.0, 0.0)
    return [(step.number, tuple(other.number for other in after)) for step, after in ready]


def phase_of(waiting: deque[Step], processes: Mapping[str, str], *, down: bool = True) -> _Phase:
    return _Phase(waiting, ExecutionOptions(best_effort=down), processes)


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
