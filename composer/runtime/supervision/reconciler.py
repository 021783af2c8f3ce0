"""Takes nodes to their desired states, and keeps what is published about them up to date."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from functools import partial

from composer.model import PrimaryState
from composer.plan import (
    Condition,
    DesiredState,
    Fault,
    FaultKind,
    Plan,
    conditions,
    desired_states,
    is_settled,
    plan_transitions,
    reconcile,
)
from composer.runtime.supervision.events import (
    NodeTransitionFailed,
    Restarted,
    RolledBack,
    RollingBack,
    Stuck,
)
from composer.runtime.supervision.main_queue import SupervisionContext
from composer.runtime.supervision.phases import ExecutionOptions, StepFailed
from composer.runtime.supervision.plan_executor import PlanExecutor


class Reconciler:
    """The desired state of a system, and the plans that lead to it. For the main thread."""

    def __init__(self, context: SupervisionContext) -> None:
        self.context = context
        self._plan_executor = PlanExecutor(context, self._report_failed_step)
        #: The nodes that are not up again after a restart: its number, and the serial number then.
        self._restarted: dict[str, tuple[int, int]] = {}

    @property
    def desired(self) -> DesiredState:
        """The desired state now."""
        return self.context.desired.value

    @property
    def moving(self) -> Collection[str]:
        """The nodes with steps that run on after their plans."""
        return self._plan_executor.moving

    @property
    def is_settled(self) -> bool:
        """Whether all events are handled, and no required node is on its way up."""
        return self.context.main_queue.is_empty and is_settled(
            self.context.system, self.desired, self.moving
        )

    @property
    def absent(self) -> Collection[str]:
        """The nodes that are not moved until they return by themselves."""
        conditions = self.desired.conditions.items()
        return {name for name, condition in conditions if condition is Condition.ABSENT}

    def execute(self, plan: Plan, options: ExecutionOptions) -> tuple[StepFailed, ...]:
        """Execute a plan, and return the failed steps."""
        return self._plan_executor.execute(plan, options)

    def reconcile(self, cause: str) -> tuple[StepFailed, ...]:
        """Take every node to its desired state; failures on the way become faults."""
        desired = self.desired  # first: states that are newer outdate the steps of their nodes
        return self._reconcile(desired, self.context.node_set.states(), cause)

    def reconcile_settled(self, cause: str = "", end_s: float = math.inf) -> None:
        """Reconcile, but without nodes with a fault in the queue: that is handled first.

        Nor absent ones: they may be active again by now, and their return is in the queue. Slow
        steps may run on.
        """
        desired = self.desired
        left = {*desired.unhandled, *self.absent}
        states = self.context.node_set.states()
        settled = {name: at for name, at in states.items() if name not in left}
        self._reconcile(desired, settled, cause, detaches=True, end_s=end_s)

    def _reconcile(
        self,
        desired: DesiredState,
        states: Mapping[str, PrimaryState],
        cause: str,
        *,
        detaches: bool = False,
        end_s: float = math.inf,
    ) -> tuple[StepFailed, ...]:
        plan = reconcile(self.context.system, desired, states, cause)
        options = ExecutionOptions(
            best_effort=True,
            detaches=detaches,
            are_faults=True,
            serial=desired.serial,
            end_s=end_s,
        )
        failures = self._plan_executor.execute(plan, options)
        for failure in failures:
            self._on_failed_step(failure)
        self._report_restarted()
        self.publish_desired()
        return failures

    def _on_failed_step(self, failure: StepFailed) -> None:
        """Report a failed step: as a fault, unless the node is down already."""
        name = failure.step.node
        if name in self.desired.down:
            if not failure.stuck:  # otherwise, it is reported already
                self._report_failed_step(failure)
            return
        kind = FaultKind.ABSENT if self.context.node_set.nodes[name].is_absent else FaultKind.STEP
        fault = Fault(name, kind, failure.text, self.desired.serial)
        self.context.desired.update(partial(DesiredState.await_fault, fault=fault))
        self.context.main_queue.put(fault)

    def end_step(self, name: str) -> None:
        """Handle the end of a step that has run on after its plan."""
        failure = self._plan_executor.end(name)
        if failure is None:
            self.reconcile_settled(f"{self.context.full_name(name)} has moved")
        else:
            self._on_failed_step(failure)

    def roll_back(
        self, before: Mapping[str, PrimaryState], since: int, node: str, reason: str
    ) -> None:
        """Take the nodes back to the states ``before``, unless they were moved on request since.

        ``node`` has failed for ``reason``.
        """
        self.context.reporter.report(RollingBack, node, reason)
        causes = dict.fromkeys(self.context.node_set.nodes, f"{node} failed")
        desired = self.desired
        kept = {name: at for name, at in before.items() if not desired.has_moved(name, since)}
        plan = plan_transitions(self.context.system, self.context.node_set.states(), kept, causes)
        self._plan_executor.execute(plan, ExecutionOptions(best_effort=True, serial=since))
        undone = tuple(dict.fromkeys(step.full_name for step in plan.steps))
        self.context.reporter.report(RolledBack, undone)

    def note_restart(self, name: str, attempt: int) -> None:
        """Report the node once it is where it should be, unless it is moved or fails before."""
        self._restarted[name] = attempt, self.desired.serial

    def forget_restart(self, name: str) -> None:
        """Do not report the node: it has failed again."""
        self._restarted.pop(name, None)

    def _report_restarted(self) -> None:
        """Report the nodes that are where they should be after a restart, each once."""
        if self.context.main_queue.stopping:
            return
        desired, states = self.desired, self.context.node_set.states()
        for name, (attempt, serial) in tuple(self._restarted.items()):
            goal = desired.goals.get(name)
            if desired.has_moved(name, serial) or goal in (None, PrimaryState.UNCONFIGURED):
                del self._restarted[name]
            elif states.get(name) is goal and name not in desired.unhandled:
                del self._restarted[name]
                self.context.reporter.report(
                    Restarted, self.context.full_name(name), attempt, str(goal)
                )

    def publish_desired(self) -> None:
        """Publish the desired states, and what becomes of failed nodes."""
        desired = self.desired
        goals = desired_states(self.context.system, desired)
        states = {name: state.value for name, state in goals.items()}
        moving = self.moving
        words = conditions(self.context.system, desired, self.context.node_set.states(), moving)
        self.context.status.set_desired(states, desired.down, words)
        if desired.goals:  # the bring-up is over
            self.context.node_set.other_processes.keep_goals(desired.goals, desired.activity)

    def _report_failed_step(self, failure: StepFailed) -> None:
        step = failure.step
        node, transition = step.full_name, step.transition
        if failure.stuck:
            self.context.reporter.report(Stuck, node, transition, failure.stack)
        else:
            details = node, transition, failure.state, failure.reason
            self.context.reporter.report(NodeTransitionFailed, *details)
