"""What runs of a plan: its steps with their time limits, one phase after the other."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import field, replace

from composer.base.fast_dataclass import dataclass
from composer.plan import Step
from composer.runtime.executors.futures import Future
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.supervision.main_queue import Item, MainQueue

#: A wait in slices shows in which of them this process did not run.
_SLICE_S = 0.1


@dataclass(frozen=True, slots=True)
class StepFailed:
    """A step that failed, and the state that the node is in.

    ``stuck`` is true if the step was abandoned, or a callback was interrupted that blocked it;
    ``stack`` is where that callback was. ``outdated`` is true if it was not run because a requested
    transition came first.
    """

    step: Step
    reason: str
    state: str
    stuck: bool = False
    stack: str = ""
    outdated: bool = False

    def __str__(self) -> str:
        return f"{self.step.full_name}: {self.text}"

    @property
    def text(self) -> str:
        """What failed and why, without the name of the node."""
        return f"{self.step.transition} failed: {self.reason}"


@dataclass(frozen=True, slots=True)
class ExecutionOptions:
    """How a plan is executed.

    With ``best_effort``, failures do not end the plan: every step that the states allow is run, and
    steps start in the order of the plan. If ``stoppable``, a request to stop the system ends the
    plan. Steps that have not ended at ``end_s`` (monotonic) have failed; no step gets longer than
    ``step_limit_s``. With ``detaches``, steps that no other node waits for may run on after the
    plan; their ends are in the main queue. With ``are_faults``, the caller reports the failures.

    ``serial`` is that of the desired state that the plan is based on. Nodes that have been moved
    on request since then are not moved; None moves them as well.
    """

    best_effort: bool = False
    detaches: bool = False
    are_faults: bool = False
    stoppable: bool = True
    end_s: float = math.inf
    step_limit_s: float = math.inf
    serial: int | None = None


@dataclass(slots=True)
class RunningStep:
    """A step that runs, and its time limits.

    A loop runs the transitions of its nodes one after the other: ``started_s`` is when it last
    started one, and the step is late if the loop then starts nothing for ``limit_s``.
    """

    step: Step
    loop: str
    future: Future[TransitionOutcome]
    started_s: float
    limit_s: float
    end_s: float
    is_reported: bool = False  # as stuck

    @property
    def late_s(self) -> float:
        """When the step is late."""
        return self.started_s + self.limit_s

    @property
    def until_s(self) -> float:
        """When the step has to end."""
        return min(self.late_s, self.end_s)


@dataclass(slots=True)
class Phase:
    """A phase that is being executed.

    ``processes`` are the other processes of the system, by the nodes that they run. ``done`` are
    the numbers of steps that nothing waits for any more, ``unreached`` of those upward steps among
    them after which the node is not where others need it. All phases of a plan share both.
    ``ended`` are the numbers of steps that have ended by themselves; until ``check_s``, no other
    one has to be looked at.
    """

    waiting: deque[Step]
    options: ExecutionOptions
    processes: Mapping[str, str]
    done: set[int] = field(default_factory=set)
    unreached: set[int] = field(default_factory=set)
    running: dict[int, RunningStep] = field(default_factory=dict)
    failures: list[StepFailed] = field(default_factory=list)
    ended: deque[int] = field(default_factory=deque)
    check_s: float = math.inf

    @property
    def is_awaited(self) -> bool:
        """Whether a step runs that the plan has to wait for."""
        running = (item.step for item in self.running.values())
        return any(step.is_awaited or not self.options.detaches for step in running)

    @property
    def has_failed(self) -> bool:
        """Whether a failure ends the phase."""
        return bool(self.failures) and not self.options.best_effort

    def postpone(self, lost_s: float) -> None:
        """Move all time limits: the process did not run for ``lost_s``, and no step could."""
        self.options = replace(self.options, end_s=self.options.end_s + lost_s)
        self.check_s += lost_s
        for item in self.running.values():
            item.limit_s += lost_s
            item.end_s += lost_s

    def finish(self, step: Step, *, is_reached: bool) -> None:
        """Let nothing wait for a step any more; others do not go up without its node."""
        self.done.add(step.number)
        if step.is_upward and not is_reached:
            self.unreached.add(step.number)

    def take_ready(self) -> list[tuple[Step, tuple[Step, ...]]]:
        """Remove and return the steps that can start now, each with those that it waits for.

        On the way down, it may wait for steps of its own process, which keeps the order by itself.
        """
        if self.has_failed:
            return []
        started = {number: item.step for number, item in self.running.items()}
        ready: list[tuple[Step, tuple[Step, ...]]] = []
        waiting: deque[Step] = deque()
        for step in self.waiting:
            keeps_order = step.is_upward or not (waiting and self.options.best_effort)
            if not self.unreached.isdisjoint(step.after):
                self.finish(step, is_reached=False)
            elif keeps_order and self._can_start(step, started):
                after = (started[number] for number in step.after if number not in self.done)
                ready.append((step, tuple(after)))
                started[step.number] = step
            else:
                waiting.append(step)
        self.waiting = waiting
        return ready

    def _can_start(self, step: Step, started: Mapping[int, Step]) -> bool:
        if self.done.issuperset(step.after):
            return True
        process = self.processes.get(step.node)
        if process is None or step.is_upward or not self.options.best_effort:
            return False
        left = (started.get(number) for number in step.after if number not in self.done)
        return all(other and self.processes.get(other.node) == process for other in left)


def wait_for_step(phase: Phase, main_queue: MainQueue[Item]) -> None:
    """Wait until a step has ended or has no time left, or a request to stop ends the plan.

    On a busy machine, or if it is suspended, this process does not run for a while.
    """
    while True:
        until_s = min(phase.check_s, main_queue.clock.monotonic() + _SLICE_S)
        ended = main_queue.wait(
            lambda: bool(phase.ended), until_s, stoppable=phase.options.stoppable
        )
        lost_s = main_queue.clock.monotonic() - until_s
        if lost_s > _SLICE_S:
            phase.postpone(lost_s)
        is_stopped = main_queue.urgent or (main_queue.stopping and phase.options.stoppable)
        if ended or is_stopped or main_queue.clock.monotonic() >= phase.check_s:
            return
