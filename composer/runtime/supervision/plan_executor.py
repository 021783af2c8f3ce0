"""Executes plans: runs the steps, waits for them, and reports the failed ones. Decides nothing."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial

from composer.plan import Plan, Step
from composer.runtime.supervision.main_queue import NodeMoved, StepEnded, SupervisionContext
from composer.runtime.supervision.phases import (
    ExecutionOptions,
    Phase,
    RunningStep,
    StepFailed,
    wait_for_step,
)

#: A transition times out by itself; only a callback that does not return takes this much longer.
_STUCK_AFTER_S = 1.0
#: How long an interrupted callback may take to return.
_INTERRUPTED_WITHIN_S = 0.4


class PlanExecutor:
    """Executes plans, one at a time, on the main thread."""

    def __init__(
        self, context: SupervisionContext, report_failure: Callable[[StepFailed], None]
    ) -> None:
        """Call ``report_failure`` for each failed step as soon as it has failed, or is stuck."""
        self._context = context
        self._report_failure = report_failure
        self._detached: dict[str, RunningStep] = {}

    @property
    def moving(self) -> Collection[str]:
        """The nodes with steps that run on after their plans."""
        return self._detached.keys()

    def end(self, node: str) -> StepFailed | None:
        """Return why the step of a node failed that has run on; see :class:`.StepEnded`."""
        failure = self._failure(self._detached.pop(node))
        return None if failure is None or failure.outdated else failure

    def execute(
        self, plan: Plan, options: ExecutionOptions | None = None
    ) -> tuple[StepFailed, ...]:
        """Run the steps of a plan; return the failed ones, in the order in which they ended."""
        options = options or ExecutionOptions()
        failures: list[StepFailed] = []
        done: set[int] = set()
        unreached: set[int] = set()
        for steps in plan.phases:
            phase = Phase(deque(steps), options, self._context.node_set.process_of, done, unreached)
            self._execute(phase)
            options = phase.options  # the time limit may have moved
            failures += phase.failures
            # What follows a failure on the way up is decided before other nodes go further.
            is_failure = bool(phase.failures) and any(step.is_upward for step in steps)
            if is_failure or phase.has_failed or self._is_stopped(options):
                break
        return tuple(failures)

    def _execute(self, phase: Phase) -> None:
        while self._start_ready(phase):
            wait_for_step(phase, self._context.main_queue)
            if self._is_stopped(phase.options):
                return
            while phase.ended:
                self._end(phase.ended.popleft(), phase)
            if self._context.main_queue.urgent or self._context.clock.monotonic() >= phase.check_s:
                self._end_late(phase)
        for item in phase.running.values():
            self._detach(item)

    def _start_ready(self, phase: Phase) -> bool:
        """Start every step that can start; return whether one was started that is awaited."""
        while ready := phase.take_ready():
            with self._context.node_set.other_processes.requests_together():
                for step, after in ready:
                    self._start(step, after, phase)
        return phase.is_awaited

    def _detach(self, item: RunningStep) -> None:
        name = item.step.node
        self._detached[name] = item
        item.future.add_done_callback(lambda _: self._context.main_queue.put(StepEnded(name)))

    def _end_late(self, phase: Phase) -> None:
        """End the steps that have no time left."""
        self._update_start_times(phase.running.values())
        for number, item in tuple(phase.running.items()):
            if self._context.main_queue.urgent or self._context.clock.monotonic() >= item.until_s:
                self._end(number, phase)
        phase.check_s = min((item.until_s for item in phase.running.values()), default=math.inf)

    def _update_start_times(self, running: Iterable[RunningStep]) -> None:
        """Restart the time limit of each step with the last transition that its loop started."""
        starts_s: dict[str, float] = {}
        for node in self._context.node_set.nodes.values():
            loop = node.loop.name
            starts_s[loop] = max(node.transition_started_s, starts_s.get(loop, 0.0))
        for item in running:
            item.started_s = max(item.started_s, starts_s.get(item.loop, 0.0))

    def _is_stopped(self, options: ExecutionOptions) -> bool:
        return self._context.main_queue.stopping and options.stoppable

    def _start(self, step: Step, after: Sequence[Step], phase: Phase) -> None:
        node = self._context.node_set.nodes[step.node]
        options = phase.options
        now_s = self._context.clock.monotonic()
        # A tear-down waits for the steps of earlier plans.
        is_running = step.node in self._detached
        is_possible = step.transition in node.lifecycle.available and not is_running
        if options.best_effort and (
            self._context.node_set.is_lost(step.node)
            or not (is_possible or (is_running and not options.stoppable))
            or now_s >= options.end_s
        ):
            phase.finish(step, is_reached=False)
            return
        limit_s = min(node.transition_timeout_s + _STUCK_AFTER_S, options.step_limit_s)
        is_outdated = partial(self._is_outdated, step, options)
        others = tuple(other.full_name for other in after)
        future = self._context.node_set.run_step(step.node, step.transition, is_outdated, others)
        name = node.loop.name
        item = RunningStep(step, name, future, now_s, limit_s, options.end_s)
        phase.running[step.number] = item
        phase.check_s = min(phase.check_s, item.until_s)
        future.add_done_callback(partial(self._on_done, phase, step.number))

    def _on_done(self, phase: Phase, number: int, _: object) -> None:
        phase.ended.append(number)
        self._context.main_queue.wakeup.wake()

    def _is_outdated(self, step: Step, options: ExecutionOptions) -> bool:
        """Return whether a requested transition or a fault came first.

        Called once no other transition can.
        """
        if options.serial is not None:
            desired = self._context.desired.value
            has_failed = options.best_effort and step.node in desired.unhandled
            return has_failed or desired.has_moved(step.node, options.serial)
        node = self._context.node_set.nodes[step.node]
        return options.best_effort and step.transition not in node.lifecycle.available

    def _end(self, number: int, phase: Phase) -> None:
        item = phase.running.pop(number, None)
        if item is None:
            return  # it had no time left before
        failure = self._failure(item)
        phase.finish(item.step, is_reached=failure is None)
        if not item.future.done():
            moved = NodeMoved(item.step.node, f"late end of '{item.step.transition}'")
            item.future.add_done_callback(lambda _: self._context.main_queue.put(moved))
        if failure is not None and not (failure.outdated and phase.options.best_effort):
            phase.failures.append(failure)
            if not item.is_reported and (failure.stuck or not phase.options.are_faults):
                self._report_failure(failure)

    def _failure(self, item: RunningStep) -> StepFailed | None:
        """Return why a step failed that is done or out of time."""
        node = self._context.node_set.nodes[item.step.node]
        stack = ""
        if not item.future.done():
            stack = self._unblock(item)
        if not item.future.done():
            if stack:
                self._context.node_set.hung.add(node.loop.name)
            stuck = (
                bool(stack)
                or self._context.main_queue.urgent
                or self._context.clock.monotonic() >= item.late_s
            )
            reason = "stuck" if stuck else "no time left"
            return StepFailed(item.step, reason, node.state, stuck=stuck, stack=stack)
        if item.future.cancelled():
            return StepFailed(item.step, "its executor has stopped", node.state)
        result = item.future.result()
        if result.success and not stack:
            return None
        reason = result.reason or "blocked by another callback for too long"
        return StepFailed(
            item.step,
            reason,
            result.state,
            stuck=bool(stack),
            stack=stack,
            outdated=result.outdated,
        )

    def _unblock(self, item: RunningStep) -> str:
        """Interrupt the callback that a step hangs in or waits for; return the stack of it.

        Until the step is late, only callbacks of the node itself are interrupted.
        """
        node = self._context.node_set.nodes[item.step.node]
        if self._context.node_set.is_lost(item.step.node):
            return node.loop.current_stack()
        running = self._context.node_set.running_callbacks(item.step.node)
        own = [callback for callback in running if callback.node((node,)) is node]
        if not own and self._context.clock.monotonic() < item.late_s:
            return ""
        stack = node.loop.current_stack()
        if running:  # report it now: once it is interrupted, the node may continue
            item.is_reported = True
            failure = StepFailed(item.step, "stuck", node.state, stuck=True, stack=stack)
            self._report_failure(failure)
        for callback in own or running:
            callback.interrupt()
        if running:
            until_s = self._context.clock.monotonic() + _INTERRUPTED_WITHIN_S
            self._context.main_queue.wait(item.future.done, until_s, stoppable=False)
        return stack
