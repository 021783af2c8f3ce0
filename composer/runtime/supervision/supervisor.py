"""Keeps a system in its desired state: handles faults, requested transitions and restarts.

:mod:`composer.plan` decides what to do. The supervisor does it, on the main thread, one event at a
time, and owns the clock of the restarts. Nodes record requested transitions in the desired state
themselves, so every plan is based on all of them (see :mod:`.main_queue`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

from composer.base.characters import shortened
from composer.model import PrimaryState
from composer.plan import (
    Condition,
    DesiredState,
    Fault,
    FaultKind,
    Plan,
    Restart,
    is_nothing_left,
    reconcile,
)
from composer.runtime.supervision.main_queue import (
    Command,
    LoopRecovered,
    NodeEvent,
    NodeMoved,
    NodeReturned,
    StepEnded,
)
from composer.runtime.supervision.phases import ExecutionOptions, StepFailed
from composer.runtime.supervision.reconciler import FaultHandler, Reconciler

#: In the cause of a plan that moves of several nodes have caused.
_MAX_CAUSES = 3


class Supervisor:
    """The desired state of a system, and the reactions to everything that deviates from it."""

    def __init__(self, reconciler: Reconciler) -> None:
        self.reconciler = reconciler
        self.context = reconciler.context
        self._faults = FaultHandler(reconciler)

    @property
    def desired(self) -> DesiredState:
        """The desired state now."""
        return self.context.desired.value

    @property
    def has_failed_nodes(self) -> bool:
        """Whether a node is held down, or ended the system, that the system needs.

        A program that has ended itself with exit status 0 does not count.
        """
        conditions = self.desired.conditions
        return any(
            self.context.node_set.nodes[name].model.required
            for name in self.desired.down
            if conditions.get(name) is not Condition.FINISHED
        )

    def has_moved(self, node: str, since: int) -> bool:
        """Return whether a requested transition has moved the node since a serial number."""
        return self.desired.has_moved(node, since)

    # --- the whole system

    def set_goals(
        self,
        goals: Mapping[str, PrimaryState],
        since: int,
        activity: str = "",
        *,
        forget_failures: bool = False,
    ) -> None:
        """Change the goals of nodes, except of those moved on request since a serial number.

        ``activity`` is the activity of the system with these goals; by default, it does not change.
        """

        def change(desired: DesiredState) -> DesiredState:
            kept = desired.forget_failures() if forget_failures else desired
            return kept.with_goals(goals, since, activity)

        self.context.desired.update(change)
        self.reconciler.publish_desired()

    def bring_up(
        self,
        goals: Mapping[str, PrimaryState],
        run_command: Callable[[Command], None],
        since: int,
        within_s: float,
    ) -> str | None:
        """Bring a system up, and handle failures by the policies of the nodes.

        Return why it failed and was rolled back: it took too long, or no node is left. None if all
        nodes are up or their failures are handled, and if the system stops: a failure may have
        ended it.
        """
        end_s = self.context.clock.monotonic() + within_s
        self._faults.before = self.context.node_set.states(), since
        self.set_goals(goals, since, "running")
        self.reconciler.reconcile_settled("bring-up", end_s)
        self.run(run_command, end_s, until=lambda: self.reconciler.is_settled)
        desired, reason = self.desired, ""
        if not self.reconciler.is_settled:
            reason = f"bring-up timed out after {within_s:g} s"
        elif is_nothing_left(self.context.system, desired):
            reason = next(iter(desired.down.values()))
        before, self._faults.before = self._faults.before, None
        if self.context.main_queue.stopping or not reason:
            return None
        failed = (*desired.down, *desired.unhandled, *self.reconciler.moving)
        names = (self.context.full_name(name) for name in failed)
        name = next(names, "the system")
        self.reconciler.roll_back(*before, name, reason)
        return f"{name} failed"

    def settle(self) -> None:
        """Handle events until no required node is on its way up, or a command comes."""
        self.run(None, until=lambda: self.reconciler.is_settled)

    def bring_up_together(self, plan: Plan, since: int, within_s: float = math.inf) -> str | None:
        """Execute a plan, all or nothing; return why it failed and was rolled back, or None.

        ``since`` is the serial number of the desired state that the plan is based on.
        """
        before = self.context.node_set.states()
        end_s = self.context.clock.monotonic() + within_s
        options = ExecutionOptions(end_s=end_s, serial=since)
        failures = self.reconciler.execute(plan, options)
        if not failures:
            return None
        step, reason = failures[0].step, failures[0].text
        if self.context.clock.monotonic() >= end_s:
            reason = f"{step.transition} failed: bring-up timed out after {within_s:g} s"
        self.reconciler.roll_back(before, since, step.full_name, reason)
        return f"{step.full_name}: {reason}"

    def take_down(self, names: Iterable[str], cause: str) -> tuple[StepFailed, ...]:
        """Take nodes down as if they had failed, for a restart, and return the failed steps.

        The nodes that depend on them become inactive. The desired states do not change.
        """
        desired = self.desired
        lowered = desired
        for name in names:
            lowered = lowered.fail(Fault(name, FaultKind.STEP, cause, lowered.serial))
        plan = reconcile(self.context.system, lowered, self.context.node_set.states(), cause)
        options = ExecutionOptions(best_effort=True, serial=desired.serial)
        return self.reconciler.execute(plan, options)

    def release(self, names: Iterable[str]) -> None:
        """Forget the failures of nodes and their restarts."""
        self.context.desired.update(partial(DesiredState.forget_failures, nodes=tuple(names)))

    def tear_down(self, plan: Plan, end_s: float, step_limit_s: float) -> bool:
        """Execute a plan as far as possible; return whether nothing failed."""
        options = ExecutionOptions(
            best_effort=True, stoppable=False, end_s=end_s, step_limit_s=step_limit_s
        )
        return not self.reconciler.execute(plan, options)

    # --- events

    def run(
        self,
        run_command: Callable[[Command], None] | None,
        end_s: float = math.inf,
        until: Callable[[], bool] = lambda: False,
    ) -> None:
        """Handle events and due restarts until a stop is requested, ``end_s``, or ``until()``.

        Without ``run_command``, the first command in the queue also ends the run.
        """
        while not (
            self.context.main_queue.stopping or self.context.clock.monotonic() >= end_s or until()
        ):
            now_s = self.context.clock.monotonic()
            due = [item for item in self.desired.scheduled.values() if item.due_s <= now_s]
            if due:
                self.restart(due)
                continue
            restart = self.desired.next_restart
            due_s = math.inf if restart is None else restart.due_s
            item = self.context.main_queue.get(min(end_s, due_s))
            if isinstance(item, Command):
                if run_command is None:
                    self.context.main_queue.put_back(item)
                    return
                run_command(item)
            elif item is not None:
                self.handle(item)

    def handle(self, event: NodeEvent) -> None:
        """Handle an event, and events of its kind that follow: many nodes may fail at once."""
        match event:
            case Fault() as fault:
                self._faults.handle([fault, *self.context.main_queue.take_next(Fault)])
            case NodeMoved() as moved:
                self._on_moved([moved, *self.context.main_queue.take_next(NodeMoved)])
            case StepEnded(node=name):
                self.reconciler.end_step(name)
            case LoopRecovered() as recovered:
                self._faults.on_loop_recovered(recovered)
            case NodeReturned(node=name):
                self._on_returned(name)

    def _on_moved(self, moved: Sequence[NodeMoved]) -> None:
        causes = tuple(dict.fromkeys(item.cause for item in moved if item.cause))
        self.reconciler.reconcile_settled(shortened(causes, _MAX_CAUSES))

    def restart(self, restarts: Iterable[Restart]) -> None:
        """Restart failed nodes together, unless requested transitions come first."""
        texts: list[str] = []
        for restart in restarts:
            name, serial = restart.node, self.desired.serial
            if self.desired.scheduled.get(name) != restart:
                continue
            self.context.desired.update(
                partial(DesiredState.restart, node=name, at_s=self.context.clock.monotonic())
            )
            self.context.status.count_restart(name)
            problem = self.context.node_set.recreate(name, partial(self.has_moved, name, serial))
            if problem is not None:
                self._faults.handle(
                    [Fault(name, FaultKind.TRANSITION, problem, self.desired.serial)]
                )
                continue
            self.reconciler.note_restart(name, restart.attempt)
            texts.append(f"restart {restart.attempt} of {self.context.full_name(name)}")
        if texts:
            self.reconciler.reconcile_settled(", ".join(texts))

    def _on_returned(self, name: str) -> None:
        """Bring a node up again that was not there, or not as expected, and what depends on it."""
        self.context.desired.update(partial(DesiredState.release, node=name))
        self.reconciler.reconcile_settled(f"{self.context.full_name(name)} is there again")
