"""Carries plans out, and decides nothing: it makes steps, waits, and tells what became of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from composer.plan import Plan, Step
from composer.runtime.executors.tasks import Future
from composer.runtime.node.lifecycle import Result
from composer.runtime.supervision.interruption import running_callbacks
from composer.runtime.supervision.main_queue import MainQueue
from composer.runtime.supervision.node_set import NodeSet

#: A transition ends itself in time; only a callback that does not return outlasts it by this.
_STUCK_AFTER_S = 1.0
#: How long an interrupted callback may take to end.
_INTERRUPTED_WITHIN_S = 0.4


@dataclass(frozen=True, slots=True)
class StepFailed:
    """A step that did not get where it was to.

    ``stuck`` is true when it had to be given up, or a callback in its way to be interrupted;
    ``stack`` is where that was.
    """

    step: Step
    reason: str
    state: str
    stuck: bool = False
    stack: str = ""


@dataclass(frozen=True, slots=True)
class ExecutionOptions:
    """How a plan is carried out.

    When ``lenient``, every step that the states allow is made, whatever becomes of the others, and
    they begin in the order of the plan; else the first failure ends it. When ``stoppable``, a
    request to stop the system ends it. What is not through when ``time.monotonic()`` says ``end_s``
    has failed; no step gets longer than ``share_s``.
    """

    lenient: bool = False
    stoppable: bool = True
    end_s: float = math.inf
    share_s: float = math.inf


@dataclass(slots=True)
class _Running:
    """A step under way, how long its loop may not go on, and until when it may take at most.

    A loop makes the transitions of its nodes one after the other: ``since_s`` is when it last began
    the work of one.
    """

    step: Step
    loop: str
    future: Future[Result]
    since_s: float
    may_take_s: float
    end_s: float

    @property
    def limit_s(self) -> float:
        """Until when it may take."""
        return self.since_s + self.may_take_s

    @property
    def until_s(self) -> float:
        """When to look what became of it."""
        return min(self.limit_s, self.end_s)


@dataclass(slots=True)
class _Phase:
    """A phase that is being carried out."""

    waiting: list[Step]
    manner: ExecutionOptions
    running: list[_Running] = field(default_factory=list)
    done: set[int] = field(default_factory=set)
    failures: list[StepFailed] = field(default_factory=list)

    @property
    def is_over(self) -> bool:
        """Whether nothing runs, and nothing more will be begun."""
        return not self.running and (not self.waiting or self.given_up)

    @property
    def given_up(self) -> bool:
        """Whether nothing more is to be begun."""
        return bool(self.failures) and not self.manner.lenient

    def take_ready(self) -> list[Step]:
        """Take out the steps that wait for nothing more."""
        if self.given_up:
            return []
        ready: list[Step] = []
        left: list[Step] = []
        for step in self.waiting:
            in_turn = not (left and self.manner.lenient)
            fit = in_turn and self.done.issuperset(step.after)
            (ready if fit else left).append(step)
        self.waiting = left
        return ready


class PlanExecutor:
    """Carries out plans, one at a time, on the main thread."""

    def __init__(
        self,
        node_set: NodeSet,
        main_queue: MainQueue[object],
        tell_failed: Callable[[StepFailed], None],
    ) -> None:
        """``tell_failed`` is told of every step that failed, when it did."""
        self._node_set = node_set
        self._main_queue = main_queue
        self._tell_failed = tell_failed
        #: The nodes that are being moved now, by their keys.
        self.moving: set[str] = set()

    def carry_out(
        self, plan: Plan, manner: ExecutionOptions | None = None
    ) -> tuple[StepFailed, ...]:
        """Make the steps of a plan; return those that failed, in the order of their ends."""
        manner = manner or ExecutionOptions()
        failures: list[StepFailed] = []
        for steps in plan.phases:
            phase = _Phase(list(steps), manner)
            self._carry_out(phase)
            failures += phase.failures
            if phase.given_up or self._is_called_off(manner):
                break
        return tuple(failures)

    def _carry_out(self, phase: _Phase) -> None:
        while not phase.is_over:
            for step in phase.take_ready():
                self._begin(step, phase)
            if not phase.running:
                continue
            self._main_queue.wait(
                lambda: any(item.future.done() for item in phase.running),
                min(item.until_s for item in phase.running),
                stoppable=phase.manner.stoppable,
            )
            if self._is_called_off(phase.manner):
                break
            self._note_turns(phase.running)
            for item in tuple(phase.running):
                if self._has_had_its_time(item):
                    self._end(item, phase)
        self.moving.clear()

    def _note_turns(self, running: list[_Running]) -> None:
        """Let the time of each begin anew with the last turn on its loop."""
        turns_s: dict[str, float] = {}
        for node in self._node_set.nodes.values():
            loop = node.loop.name
            turns_s[loop] = max(node.turn_s, turns_s.get(loop, 0.0))
        for item in running:
            item.since_s = max(item.since_s, turns_s.get(item.loop, 0.0))

    def _is_called_off(self, manner: ExecutionOptions) -> bool:
        return self._main_queue.closing and manner.stoppable

    def _has_had_its_time(self, item: _Running) -> bool:
        return item.future.done() or self._main_queue.hurry or time.monotonic() >= item.until_s

    def _begin(self, step: Step, phase: _Phase) -> None:
        node = self._node_set.nodes[step.node]
        manner = phase.manner
        now_s = time.monotonic()
        if manner.lenient and (
            self._node_set.is_lost(step.node) or step.transition not in node.legal
            or now_s >= manner.end_s
        ):  # fmt: skip
            phase.done.add(step.number)
            return
        may_take_s = min(self._node_set.timeout_s(step.node) + _STUCK_AFTER_S, manner.share_s)
        self.moving.add(step.node)
        future = node.loop.run_task(node.change(step.transition))
        future.add_done_callback(lambda _: self._main_queue.wake())
        name = node.loop.name
        phase.running.append(_Running(step, name, future, now_s, may_take_s, manner.end_s))

    def _end(self, item: _Running, phase: _Phase) -> None:
        phase.running.remove(item)
        phase.done.add(item.step.number)
        self.moving.discard(item.step.node)
        self._note_where(item)
        failure = self._failure(item)
        if failure is not None:
            phase.failures.append(failure)
            self._tell_failed(failure)

    def _note_where(self, item: _Running) -> None:
        """Note where a step has left its node; one that goes on has left it nowhere yet."""
        if item.future.done() and not item.future.cancelled():
            self._node_set.left[item.step.node] = item.future.result().state
        else:
            self._node_set.left.pop(item.step.node, None)

    def _failure(self, item: _Running) -> StepFailed | None:
        """Return what went wrong with a step that is done or has had its time."""
        node = self._node_set.nodes[item.step.node]
        stack = ""
        if not item.future.done():
            stack = self._free(item)
        if not item.future.done():
            if stack:
                self._node_set.hung.add(node.loop.name)
            stuck = bool(stack) or self._main_queue.hurry or time.monotonic() >= item.limit_s
            reason = "it is stuck" if stuck else "there was no time left for it"
            return StepFailed(item.step, reason, node.state, stuck=stuck, stack=stack)
        if item.future.cancelled():
            return StepFailed(item.step, "its executor stops", node.state)
        result = item.future.result()
        if result.success and not stack:
            return None
        reason = result.reason or "a callback was in the way for too long"
        return StepFailed(item.step, reason, result.state, stuck=bool(stack), stack=stack)

    def _free(self, item: _Running) -> str:
        """Interrupt the callback that a step hangs in, or waits for; return the stack of that.

        Before the step's own time is over, that is only what the node itself does.
        """
        node = self._node_set.nodes[item.step.node]
        if self._node_set.is_lost(item.step.node):
            return node.loop.where()
        found = [innermost for innermost, *_ in running_callbacks(node.loop)]
        own = [callback for callback in found if callback.node((node,)) is node]
        if not own and time.monotonic() < item.limit_s:
            return ""
        stack = node.loop.where()
        for callback in own or found:
            callback.interrupt()
        if found:
            until_s = time.monotonic() + _INTERRUPTED_WITHIN_S
            self._main_queue.wait(item.future.done, until_s, stoppable=False)
        return stack
