"""Keeps a system in its desired state: handles faults, external transitions and restarts.

:mod:`composer.plan` decides what to do. The supervisor does it, on the main thread, one event at a
time, and owns the clock of the restarts. Nodes record external transitions in the desired state
themselves, so every plan is based on all of them (see :mod:`.shared_desired_state`).
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from composer.model import LogLevel, OnFailure, PrimaryState, System
from composer.plan import (
    Decision,
    DesiredState,
    Fault,
    FaultKind,
    Plan,
    Restart,
    Step,
    decide,
    desired_states,
    plan_transitions,
    reconcile,
)
from composer.runtime.node.outcome import FINALIZED
from composer.runtime.supervision.events import (
    NodeFailed,
    NodeTransitionFailed,
    Reporter,
    Restarted,
    RolledBack,
    RollingBack,
    Stuck,
)
from composer.runtime.supervision.main_queue import (
    CallbackBlocks,
    CallbackHanging,
    Command,
    Item,
    LoopRecovered,
    MainQueue,
    NodeEvent,
    NodeMoved,
    NodeReturned,
)
from composer.runtime.supervision.plan_executor import ExecutionOptions, PlanExecutor, StepFailed
from composer.runtime.supervision.shared_desired_state import SharedDesiredState
from composer.runtime.supervision.status import Status

if TYPE_CHECKING:  # this module and its tests need no ROS
    from composer.runtime.supervision.node_set import NodeSet

#: In the cause of a plan that moves of several nodes have caused.
_MAX_CAUSES = 3
_DOWN = (PrimaryState.UNCONFIGURED, FINALIZED)


class Supervisor:
    """The desired state of a system, and the reactions to everything that deviates from it."""

    def __init__(
        self,
        system: System,
        node_set: NodeSet,
        main_queue: MainQueue[Item],
        status: Status,
        reporter: Reporter,
    ) -> None:
        self._system = system
        self._node_set = node_set
        #: Also changed by the nodes, which record external transitions.
        self.shared = SharedDesiredState()
        self._main_queue = main_queue
        self._status = status
        self._reporter = reporter
        self._plan_executor = PlanExecutor(
            node_set, self.shared, main_queue, self._report_failed_step
        )
        self._abandoned: dict[str, set[str]] = {}  # by hung loop: the nodes that did not fail
        self._absent: set[str] = set()  # failed, and not moved until they return by themselves

    @property
    def desired(self) -> DesiredState:
        """The desired state now."""
        return self.shared.value

    @property
    def has_failed_nodes(self) -> bool:
        """Whether a node is held down, or ended the system."""
        return bool(self.desired.down)

    def has_moved(self, node: str, since: int) -> bool:
        """Return whether an external transition has moved the node since a serial number."""
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
        """Change the goals of nodes, except of those moved externally since a serial number.

        ``activity`` is that of the system with these goals; by default, it does not change.
        """

        def change(desired: DesiredState) -> DesiredState:
            kept = desired.forget_failures() if forget_failures else desired
            return kept.with_goals(goals, since, activity)

        self.shared.update(change)
        self._publish_desired()

    def start(self, goals: Mapping[str, PrimaryState], activity: str, since: int) -> None:
        """Set the first goals, and the activity of the system."""
        self.set_goals(goals, since, activity)
        self._status.set_activity(activity)

    def bring_up(self, plan: Plan, since: int, within_s: float = math.inf) -> str | None:
        """Execute a plan, all or nothing; return why it failed and was rolled back, or None.

        ``since`` is the serial number of the desired state that the plan is based on.
        """
        before = self._node_set.states()
        end_s = time.monotonic() + within_s
        failures = self._plan_executor.execute(plan, ExecutionOptions(end_s=end_s, serial=since))
        if not failures:
            return None
        step, reason = failures[0].step, failures[0].text
        if time.monotonic() >= end_s:
            reason = f"{step.transition} failed: bring-up timed out after {within_s:g} s"
        self._roll_back(before, since, step.full_name, reason)
        return f"{step.full_name}: {reason}"

    def take_down(self, names: Iterable[str], cause: str) -> tuple[StepFailed, ...]:
        """Take nodes down as if they had failed, for a restart, and return the failed steps.

        The nodes that depend on them become inactive. The desired states do not change.
        """
        desired = self.desired
        lowered = desired
        for name in names:
            lowered = lowered.fail(Fault(name, FaultKind.STEP, cause, lowered.serial))
        plan = reconcile(self._system, lowered, self._node_set.states(), cause)
        options = ExecutionOptions(best_effort=True, serial=desired.serial)
        return self._plan_executor.execute(plan, options)

    def release(self, names: Iterable[str]) -> None:
        """Forget the failures of nodes and their scheduled restarts."""
        for name in names:
            self.shared.update(partial(DesiredState.release, node=name))

    def reconcile(self, cause: str) -> tuple[StepFailed, ...]:
        """Take every node to its desired state; failures on the way become faults."""
        desired = self.desired  # first: states that are newer outdate the steps of their nodes
        return self._reconcile(desired, self._node_set.states(), cause)

    def reconcile_settled(self, cause: str = "") -> tuple[StepFailed, ...]:
        """Reconcile, but without nodes with a fault in the queue: that is handled first.

        Nor absent ones: they may be active again by now, and their return is in the queue.
        """
        desired = self.desired
        left = desired.unhandled.keys() | self._absent
        states = self._node_set.states()
        settled = {name: at for name, at in states.items() if name not in left}
        return self._reconcile(desired, settled, cause)

    def _reconcile(
        self, desired: DesiredState, states: Mapping[str, PrimaryState], cause: str
    ) -> tuple[StepFailed, ...]:
        plan = reconcile(self._system, desired, states, cause)
        options = ExecutionOptions(best_effort=True, serial=desired.serial)
        failures = self._plan_executor.execute(plan, options)
        for failure in failures:
            name = failure.step.node
            if name not in self.desired.down:
                kind = FaultKind.ABSENT if self._node_set.is_absent(name) else FaultKind.STEP
                fault = Fault(name, kind, failure.text, self.desired.serial)
                self.shared.update(partial(DesiredState.await_fault, fault=fault))
                self._main_queue.put(fault)
        self._publish_desired()
        return failures

    def tear_down(self, plan: Plan, end_s: float, step_limit_s: float) -> bool:
        """Execute a plan as far as possible; return whether nothing failed."""
        options = ExecutionOptions(
            best_effort=True, stoppable=False, end_s=end_s, step_limit_s=step_limit_s
        )
        return not self._plan_executor.execute(plan, options)

    def _roll_back(
        self, before: Mapping[str, PrimaryState], since: int, node: str, reason: str
    ) -> None:
        report = self._reporter.report
        report(RollingBack(self._reporter.elapsed_s, node, reason))
        causes = dict.fromkeys(self._node_set.nodes, f"{node} failed")
        desired = self.desired
        kept = {name: at for name, at in before.items() if not desired.has_moved(name, since)}
        plan = plan_transitions(self._system, self._node_set.states(), kept, causes)
        self._plan_executor.execute(plan, ExecutionOptions(best_effort=True, serial=since))
        undone = tuple(dict.fromkeys(step.full_name for step in plan.steps))
        report(RolledBack(self._reporter.elapsed_s, undone))

    # --- events

    def run(self, run_command: Callable[[Command], None], end_s: float = math.inf) -> None:
        """Handle events and due restarts until a stop is requested, or until ``end_s``."""
        while not self._main_queue.stopping and time.monotonic() < end_s:
            restart = self.desired.next_restart
            if restart is not None and time.monotonic() >= restart.due_s:
                self.restart(restart)
                continue
            due_s = math.inf if restart is None else restart.due_s
            item = self._main_queue.get(min(end_s, due_s))
            if isinstance(item, Command):
                run_command(item)
            elif isinstance(item, NodeMoved):  # many move at once if another process moves them
                self._on_moved([item, *self._main_queue.take_next(NodeMoved)])
            elif item is not None:
                self.handle(item)

    def handle(self, event: NodeEvent) -> None:
        """Handle one event."""
        match event:
            case Fault() as fault:
                self._on_fault(fault)
            case NodeMoved() as moved:
                self._on_moved([moved])
            case CallbackBlocks() as blocks:
                self._on_callback_blocks(blocks)
            case CallbackHanging() as hanging:
                self._on_callback_hanging(hanging)
            case LoopRecovered() as recovered:
                self._on_loop_recovered(recovered)
            case NodeReturned(node=name):
                self._on_returned(name)

    def _on_moved(self, moved: Sequence[NodeMoved]) -> None:
        causes = tuple(dict.fromkeys(item.cause for item in moved if item.cause))
        more = f" and {len(causes) - _MAX_CAUSES} more" * (len(causes) > _MAX_CAUSES)
        self.reconcile_settled(", ".join(causes[:_MAX_CAUSES]) + more)

    def restart(self, restart: Restart) -> None:
        """Restart a failed node, unless an external transition comes first."""
        name = restart.node
        serial = self.desired.serial
        if self.desired.scheduled.get(name) != restart:
            return
        desired = self.shared.update(lambda now: now.restart(name, time.monotonic()))
        self._status.count_restart(name)
        is_outdated = partial(self.has_moved, name, serial)
        problem = self._node_set.recreate(name, is_outdated)
        if problem is not None:
            self._on_fault(Fault(name, FaultKind.TRANSITION, problem, desired.serial))
            return
        full_name = self._node_set.nodes[name].full_name
        failures = self.reconcile_settled(f"restart {restart.attempt} of {full_name}")
        if not failures and not self._main_queue.stopping:
            self._reporter.report(Restarted(self._reporter.elapsed_s, full_name, restart.attempt))

    def _on_fault(self, fault: Fault) -> None:
        """Take a failed node down, and restart it, isolate it, or end the system."""
        name = fault.node
        node = self._node_set.nodes[name]
        decision = decide(self._system, self.desired, fault, time.monotonic())
        is_new = decision is not None and not self._is_outdated(fault)
        desired = self.shared.update(lambda now: now.fail(fault) if is_new else now.ignore(fault))
        if decision is None or not is_new or name not in desired.down:
            return
        self._status.set_error(name, fault.text)
        consequence = _consequence(decision, fault.kind)
        self._reporter.report(
            NodeFailed(self._reporter.elapsed_s, node.full_name, fault.text, consequence)
        )
        self._publish_desired()  # before the node moves: not to be taken for an external transition
        if fault.kind is FaultKind.LOST:
            node.lifecycle.fail_request()
            self._abandon_loop(name)
        elif fault.kind is FaultKind.ABSENT:
            self._absent.add(name)
        if decision.action is OnFailure.SHUTDOWN:
            self._publish_desired()
            self._main_queue.request_stop(f"{node.full_name} failed: {decision.reason}")
            return
        self.reconcile_settled()
        self._shut_down_unless_down(name)
        if self._node_set.is_lost(name) and fault.kind is not FaultKind.LOST:
            self.shared.update(lambda now: now.release(name))
            self._on_fault(replace(fault, kind=FaultKind.LOST))
        elif decision.action is OnFailure.RESTART:
            due_s = time.monotonic() + decision.wait_s
            restart = Restart(name, decision.attempt, due_s)
            self.shared.update(lambda now: now.schedule(restart))

    def _on_callback_blocks(self, blocks: CallbackBlocks) -> None:
        """Say once that a callback takes long: it may be meant to, or it may hang."""
        logger = self._node_set.nodes[blocks.node].full_name.strip("/").replace("/", ".")
        text = f"{blocks.callback} has not returned for {blocks.for_s:.0f} s; it is at"
        self._reporter.log(LogLevel.WARN, logger, f"{text} {blocks.location}")

    def _on_callback_hanging(self, hanging: CallbackHanging) -> None:
        """Report a callback that takes too long; the health monitor interrupts it."""
        full_name = self._node_set.nodes[hanging.node].full_name
        action = f"return from {hanging.callback} within {1000.0 * hanging.limit_s:g} ms"
        self._reporter.report(Stuck(self._reporter.elapsed_s, full_name, action, hanging.stack))

    def _on_loop_recovered(self, recovered: LoopRecovered) -> None:
        """Reconcile the nodes of a loop that was abandoned."""
        if recovered.loop not in self._node_set.hung:
            return
        self._node_set.hung.discard(recovered.loop)
        for name in self._abandoned.pop(recovered.loop, ()):
            self.shared.update(partial(DesiredState.release, node=name))
        self.reconcile_settled(f"executor '{recovered.loop}' runs again")

    def _on_returned(self, name: str) -> None:
        """Bring a node up again that was not there, or not as expected, and what depends on it."""
        was_absent = name in self._absent
        self._absent.discard(name)
        if was_absent or name in self.desired.down:
            self.shared.update(partial(DesiredState.release, node=name))
        full_name = self._node_set.nodes[name].full_name
        self.reconcile_settled(f"{full_name} is there again")

    def _is_outdated(self, fault: Fault) -> bool:
        """Return whether the node has left the state in which it failed."""
        state = self._node_set.nodes[fault.node].state
        match fault.kind:
            case FaultKind.TRANSITION | FaultKind.ABSENT:  # it has returned
                return state not in _DOWN
            case FaultKind.SILENCE | FaultKind.ERRORS:
                return state != PrimaryState.ACTIVE
            case _:
                return False

    def _abandon_loop(self, hanging: str) -> None:
        """Mark the loop of a hanging node as hung, and its other nodes as failed."""
        loop = self._node_set.nodes[hanging].loop.name
        self._node_set.hung.add(loop)
        full_name = self._node_set.nodes[hanging].full_name
        abandoned = self._abandoned.setdefault(loop, set())
        for name, node in self._node_set.nodes.items():
            if node.loop.name == loop and name not in self.desired.down:
                abandoned.add(name)
                text = f"its executor hangs in {full_name}"
                fault = Fault(name, FaultKind.LOST, text, self.desired.serial)
                self.shared.update(partial(DesiredState.fail, fault=fault))
                self._status.set_error(name, text)

    def _shut_down_unless_down(self, name: str) -> None:
        """Shut down a failed node that could not be cleaned up, unless it was moved externally."""
        desired = self.desired
        at = self._node_set.states().get(name, PrimaryState.UNCONFIGURED)
        is_kept_down = name in desired.down and name not in self._absent
        if is_kept_down and at is not PrimaryState.UNCONFIGURED:
            full_name = self._node_set.nodes[name].full_name
            step = Step(1, "shutdown", name, full_name, "cannot be cleaned up")
            options = ExecutionOptions(best_effort=True, serial=desired.serial)
            self._plan_executor.execute(Plan((step,)), options)

    def _report_failed_step(self, failure: StepFailed) -> None:
        step = failure.step
        at_s = self._reporter.elapsed_s
        if failure.stuck:
            self._reporter.report(Stuck(at_s, step.full_name, step.transition, failure.stack))
        else:
            self._reporter.report(
                NodeTransitionFailed(
                    at_s, step.full_name, step.transition, failure.state, failure.reason
                )
            )

    def _publish_desired(self) -> None:
        desired = self.desired
        goals = desired_states(self._system, desired)
        states = {name: state.value for name, state in goals.items()}
        self._status.set_desired(states, desired.down)
        if desired.goals:  # the bring-up is over
            self._node_set.other_processes.keep_goals(desired.goals, desired.activity)


def _consequence(decision: Decision, kind: FaultKind) -> str:
    match decision.action:
        case OnFailure.RESTART:
            return f"restart {decision.attempt} in {decision.wait_s:g} s"
        case OnFailure.ISOLATE:
            return "waiting for its return" if kind is FaultKind.ABSENT else "isolating it"
        case OnFailure.SHUTDOWN:
            return "shutting down the system"
