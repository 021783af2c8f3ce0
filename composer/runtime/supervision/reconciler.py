"""Takes nodes to their desired states, also failed ones, and keeps what is published up to date.

Failures are handled as the policies of the nodes say, see :func:`composer.plan.decide`.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial

from composer.model import OnFailure, PrimaryState
from composer.plan import (
    Condition,
    Decision,
    DesiredState,
    Fault,
    FaultKind,
    Plan,
    Restart,
    Step,
    conditions,
    decide,
    desired_states,
    is_settled,
    plan_transitions,
    reconcile,
)
from composer.runtime.supervision.events import (
    NodeFailed,
    NodeTransitionFailed,
    Restarted,
    RolledBack,
    RollingBack,
    Stuck,
)
from composer.runtime.supervision.main_queue import DOWN, LoopRecovered, SupervisionContext
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
            self.context.node_set.other_processes.goals.keep(desired.goals, desired.activity)

    def _report_failed_step(self, failure: StepFailed) -> None:
        step = failure.step
        node, transition = step.full_name, step.transition
        if failure.stuck:
            self.context.reporter.report(Stuck, node, transition, failure.stack)
        else:
            details = node, transition, failure.state, failure.reason
            self.context.reporter.report(NodeTransitionFailed, *details)


class FaultHandler:
    """Takes failed nodes down, and restarts them, isolates them, or ends the system."""

    def __init__(self, reconciler: Reconciler) -> None:
        self._reconciler = reconciler
        self._context = reconciler.context
        self._abandoned: dict[str, set[str]] = {}  # by hung loop: the nodes that did not fail
        #: During the bring-up: the states before it, and the serial number.
        self.before: tuple[Mapping[str, PrimaryState], int] | None = None

    def handle(self, faults: Iterable[Fault]) -> None:
        """Handle failures: many nodes may fail at once, for one reason."""
        now_s = self._context.clock.monotonic()
        decisions = ((fault, self._decide(fault, now_s)) for fault in faults)
        handled = [(fault, decision) for fault, decision in decisions if decision is not None]
        self._report_failed(handled)
        # Before they move: their steps are not to be taken for requested transitions.
        self._reconciler.publish_desired()
        for fault, _ in handled:
            if fault.kind is FaultKind.LOST:
                self._context.node_set.nodes[fault.node].lifecycle.fail_request()
                self._abandon_loop(fault.node)
        for fault, decision in handled:
            if decision.action is OnFailure.SHUTDOWN:
                full_name = self._context.full_name(fault.node)
                self._reconciler.publish_desired()
                if decision.is_finished:
                    self._context.main_queue.request_stop(f"{full_name} ended: {decision.reason}")
                elif self.before is None:
                    self._context.main_queue.request_stop(f"{full_name} failed: {decision.reason}")
                else:
                    self._reconciler.roll_back(*self.before, full_name, decision.reason)
                    self._context.main_queue.request_stop(f"{full_name} failed")
                return
        self._reconciler.reconcile_settled()
        for fault, decision in handled:
            self._finish(fault, decision, now_s)

    def _decide(self, fault: Fault, now_s: float) -> Decision | None:
        """Record what becomes of a failed node; None if there is nothing to do."""
        name = fault.node
        is_end = fault.kind in (FaultKind.ENDED, FaultKind.STEP)
        if is_end and self._context.node_set.nodes[name].has_finished:
            fault = replace(fault, kind=FaultKind.FINISHED)
        decision = decide(self._context.system, self._context.desired.value, fault, now_s)
        if decision is None or self._is_outdated(fault):
            self._context.desired.update(partial(DesiredState.ignore, fault=fault))
            return None
        if decision.action is OnFailure.IGNORE:
            desired = self._context.desired.update(partial(DesiredState.tolerate, fault=fault))
        else:
            desired = self._context.desired.update(lambda now: now.fail(fault, decision.condition))
        if desired.is_outdated(fault):
            return None
        self._reconciler.forget_restart(name)
        self._context.status.set_error(name, fault.text)
        return decision

    def _report_failed(self, handled: Iterable[tuple[Fault, Decision]]) -> None:
        """Report failures; the nodes of one process, for example, have failed together."""
        nodes: dict[tuple[str, str, bool, bool], list[str]] = {}
        for fault, decision in handled:
            is_tolerated = decision.action is OnFailure.IGNORE or not self._is_required(fault.node)
            key = decision.reason, decision.consequence, is_tolerated, decision.is_finished
            nodes.setdefault(key, []).append(self._context.full_name(fault.node))
        for key, names in nodes.items():
            self._context.reporter.report(NodeFailed, tuple(names), *key)

    def _finish(self, fault: Fault, decision: Decision, now_s: float) -> None:
        """Schedule the restart of a node that is down now."""
        name = fault.node
        self._shut_down_unless_down(name)
        if self._context.node_set.is_lost(name) and fault.kind is not FaultKind.LOST:
            self._context.desired.update(partial(DesiredState.release, node=name))
            self.handle([replace(fault, kind=FaultKind.LOST)])
        elif decision.action is OnFailure.RESTART:
            restart = Restart(name, decision.attempt, now_s + decision.wait_s)
            self._context.desired.update(partial(DesiredState.schedule, restart=restart))

    def on_loop_recovered(self, recovered: LoopRecovered) -> None:
        """Reconcile the nodes of a loop that was abandoned."""
        if recovered.loop not in self._context.node_set.hung:
            return
        self._context.node_set.hung.discard(recovered.loop)
        for name in self._abandoned.pop(recovered.loop, ()):
            self._context.desired.update(partial(DesiredState.release, node=name))
        self._reconciler.reconcile_settled(f"executor '{recovered.loop}' runs again")

    def _is_outdated(self, fault: Fault) -> bool:
        """Return whether the node has left the state in which it failed."""
        state = self._context.node_set.nodes[fault.node].state
        match fault.kind:
            case FaultKind.ABSENT:
                return not self._context.node_set.nodes[fault.node].is_absent
            case FaultKind.TRANSITION:
                return state not in DOWN
            case FaultKind.SILENCE | FaultKind.ERRORS:
                return state != PrimaryState.ACTIVE
            case FaultKind.REPORTED:
                return state in DOWN
            case _:
                return False

    def _abandon_loop(self, hanging: str) -> None:
        """Mark the loop of a hanging node as hung, and its other nodes as failed."""
        loop = self._context.node_set.nodes[hanging].loop.name
        self._context.node_set.hung.add(loop)
        full_name = self._context.full_name(hanging)
        abandoned = self._abandoned.setdefault(loop, set())
        for name, node in self._context.node_set.nodes.items():
            if node.loop.name == loop and name not in self._context.desired.value.down:
                abandoned.add(name)
                text = f"its executor hangs in {full_name}"
                fault = Fault(name, FaultKind.LOST, text, self._context.desired.value.serial)
                self._context.desired.update(partial(DesiredState.fail, fault=fault))
                self._context.status.set_error(name, text)

    def _shut_down_unless_down(self, name: str) -> None:
        """Shut down a failed node that could not be cleaned up, unless it was moved on request."""
        desired = self._context.desired.value
        at = self._context.node_set.states().get(name, PrimaryState.UNCONFIGURED)
        is_kept_down = name in desired.down and name not in self._reconciler.absent
        if is_kept_down and at is not PrimaryState.UNCONFIGURED:
            full_name = self._context.full_name(name)
            step = Step(1, "shutdown", name, full_name, "cannot be cleaned up")
            options = ExecutionOptions(best_effort=True, serial=desired.serial)
            self._reconciler.execute(Plan((step,)), options)

    def _is_required(self, name: str) -> bool:
        return self._context.node_set.nodes[name].model.required
