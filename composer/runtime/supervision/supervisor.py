"""Keeps a system in its desired state: handles faults, external transitions and restarts.

:mod:`composer.plan` decides what to do. The supervisor does it, on the main thread, one event at a
time, and owns the desired state and the clock of the restarts that are part of it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

from composer.model import OnFailure, PrimaryState, System
from composer.model.dependencies import dependents
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
from composer.runtime.node.lifecycle import FINALIZED
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
    CallbackHanging,
    Command,
    ExternalTransition,
    Item,
    LoopRecovered,
    MainQueue,
)
from composer.runtime.supervision.node_set import CreationFailed, NodeSet
from composer.runtime.supervision.plan_executor import ExecutionOptions, PlanExecutor, StepFailed
from composer.runtime.supervision.status import Status

_PRIMARY_STATES = {state.value: state for state in PrimaryState}
_DOWN = (PrimaryState.UNCONFIGURED, FINALIZED)
_BEST_EFFORT = ExecutionOptions(best_effort=True)


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
        self._main_queue = main_queue
        self._status = status
        self._reporter = reporter
        self._plan_executor = PlanExecutor(node_set, main_queue, self._report_failed_step)
        self._desired = DesiredState(dict.fromkeys(node_set.nodes, PrimaryState.UNCONFIGURED))
        self._abandoned: dict[str, set[str]] = {}  # by hung loop: the nodes that did not fail

    @property
    def goals(self) -> Mapping[str, PrimaryState]:
        """The desired states of the nodes, by their keys."""
        return self._desired.goals

    @property
    def has_failed_nodes(self) -> bool:
        """Whether a node is held down, or ended the system."""
        return bool(self._desired.down)

    # --- the whole system

    def set_goals(
        self, goals: Mapping[str, PrimaryState], *, forget_failures: bool = False
    ) -> None:
        """Change the desired states of some nodes."""
        self._desired = self._desired.with_goals(goals)
        if forget_failures:
            self._desired = DesiredState(self._desired.goals)
        self._publish_desired()

    def bring_up(self, plan: Plan, within_s: float = math.inf) -> str | None:
        """Execute a plan, all or nothing; return why it failed and was rolled back, or None."""
        before = self._node_set.states()
        end_s = time.monotonic() + within_s
        failures = self._plan_executor.execute(plan, ExecutionOptions(end_s=end_s))
        if not failures:
            return None
        step, reason = failures[0].step, failures[0].text
        if time.monotonic() >= end_s:
            reason = f"{step.transition} failed: bring-up timed out after {within_s:g} s"
        self._roll_back(before, step.full_name, reason)
        return f"{step.full_name}: {reason}"

    def reconcile(self, cause: str) -> tuple[StepFailed, ...]:
        """Take every node to its desired state; failures on the way become faults."""
        return self._reconcile(self._desired, self._node_set.states(), cause)

    def _reconcile_settled(self, cause: str = "") -> tuple[StepFailed, ...]:
        """Reconcile, but without nodes that have an event in the queue: that is handled first."""
        return self._reconcile(self._desired, self._node_set.settled(), cause)

    def _reconcile(
        self, desired: DesiredState, states: Mapping[str, PrimaryState], cause: str
    ) -> tuple[StepFailed, ...]:
        plan = reconcile(self._system, desired, states, cause)
        failures = self._plan_executor.execute(plan, _BEST_EFFORT)
        for failure in failures:
            if failure.step.node not in self._desired.down:
                self._main_queue.put(Fault(failure.step.node, FaultKind.STEP, failure.text))
        self._publish_desired()
        return failures

    def tear_down(self, plan: Plan, end_s: float, step_limit_s: float) -> bool:
        """Execute a plan as far as possible; return whether nothing failed."""
        options = ExecutionOptions(
            best_effort=True, stoppable=False, end_s=end_s, step_limit_s=step_limit_s
        )
        return not self._plan_executor.execute(plan, options)

    def _roll_back(self, before: Mapping[str, PrimaryState], node: str, reason: str) -> None:
        report = self._reporter.report
        report(RollingBack(self._reporter.elapsed_s, node, reason))
        causes = dict.fromkeys(self._node_set.nodes, f"{node} failed")
        plan = plan_transitions(self._system, self._node_set.states(), before, causes)
        self._plan_executor.execute(plan, _BEST_EFFORT)
        undone = tuple(dict.fromkeys(step.full_name for step in plan.steps))
        report(RolledBack(self._reporter.elapsed_s, undone))

    # --- events

    def run(self, run_command: Callable[[Command], None], end_s: float = math.inf) -> None:
        """Handle events and due restarts until a stop is requested, or until ``end_s``."""
        while not self._main_queue.stopping and time.monotonic() < end_s:
            restart = self._desired.next_restart
            if restart is not None and time.monotonic() >= restart.due_s:
                self._restart(restart)
                continue
            due_s = math.inf if restart is None else restart.due_s
            match self._main_queue.get(min(end_s, due_s)):
                case Fault() as fault:
                    self._on_fault(fault)
                case ExternalTransition() as transition:
                    self._on_external_transition(transition)
                case CallbackHanging() as hanging:
                    self._on_callback_hanging(hanging)
                case LoopRecovered() as recovered:
                    self._on_loop_recovered(recovered)
                case Command() as command:
                    run_command(command)

    def _restart(self, restart: Restart) -> None:
        name = restart.node
        self._desired = self._desired.restart(name, time.monotonic())
        self._status.count_restart(name)
        try:
            self._node_set.recreate(name)
        except CreationFailed as error:
            self._on_fault(Fault(name, FaultKind.TRANSITION, str(error)))
            return
        full_name = self._node_set.nodes[name].full_name
        failures = self._reconcile_settled(f"restart {restart.attempt} of {full_name}")
        if not failures and not self._main_queue.stopping:
            self._reporter.report(Restarted(self._reporter.elapsed_s, full_name, restart.attempt))

    def _on_fault(self, fault: Fault) -> None:
        """Take a failed node down, and restart it, isolate it, or end the system."""
        node = self._node_set.nodes[fault.node]
        self._node_set.expected[fault.node] = node.state
        decision = decide(self._system, self._desired, fault, time.monotonic())
        if decision is None or self._is_outdated(fault):
            return
        self._status.set_error(fault.node, fault.text)
        consequence = _consequence(decision)
        self._reporter.report(
            NodeFailed(self._reporter.elapsed_s, node.full_name, fault.text, consequence)
        )
        self._desired = self._desired.fail(fault)
        if fault.kind is FaultKind.LOST:
            node.lifecycle.fail_request()
            self._abandon_loop(fault.node)
        if decision.action is OnFailure.SHUTDOWN:
            self._publish_desired()
            self._main_queue.request_stop(f"{node.full_name} failed: {decision.reason}")
            return
        self._reconcile_settled()
        self._shut_down_unless_down(fault.node)
        if self._node_set.is_lost(fault.node) and fault.kind is not FaultKind.LOST:
            self._desired = self._desired.release(fault.node)
            self._on_fault(replace(fault, kind=FaultKind.LOST))
        elif decision.action is OnFailure.RESTART:
            due_s = time.monotonic() + decision.wait_s
            restart = Restart(fault.node, decision.attempt, due_s)
            self._desired = self._desired.schedule(restart)

    def _on_external_transition(self, transition: ExternalTransition) -> None:
        """Accept the new state of a node as the desired one, and adapt its dependents.

        Other nodes are not moved: their external transitions may still be in the queue.
        """
        name = transition.node
        if self._node_set.nodes[name].state != transition.state:
            return  # outdated: another event follows
        self._node_set.expected[name] = transition.state
        states = self._node_set.states()
        state = _PRIMARY_STATES.get(transition.state, PrimaryState.UNCONFIGURED)
        self._desired = self._desired.release(name).with_goals({name: state})
        moved = dependents(self._system, name)
        unmoved = {other: at for other, at in states.items() if other not in moved}
        self._reconcile(self._desired.with_goals(unmoved), states, f"external transition of {name}")

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
            self._desired = self._desired.release(name)
        self._reconcile_settled(f"executor '{recovered.loop}' runs again")

    def _is_outdated(self, fault: Fault) -> bool:
        """Return whether a transition has changed the node's state since it failed."""
        state = self._node_set.nodes[fault.node].state
        match fault.kind:
            case FaultKind.TRANSITION:
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
            if node.loop.name == loop and name not in self._desired.down:
                abandoned.add(name)
                text = f"its executor hangs in {full_name}"
                self._desired = self._desired.fail(Fault(name, FaultKind.LOST, text))
                self._status.set_error(name, text)

    def _shut_down_unless_down(self, name: str) -> None:
        """Shut down a failed node that could not be cleaned up, unless it was moved externally."""
        node = self._node_set.nodes[name]
        down = PrimaryState.UNCONFIGURED
        if self._node_set.settled().get(name, down) is not down:
            step = Step(1, "shutdown", name, node.full_name, "cannot be cleaned up")
            self._plan_executor.execute(Plan((step,)), _BEST_EFFORT)

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
        goals = desired_states(self._system, self._desired)
        states = {name: state.value for name, state in goals.items()}
        self._status.set_desired(states, self._desired.down)


def _consequence(decision: Decision) -> str:
    match decision.action:
        case OnFailure.RESTART:
            return f"restart {decision.attempt} in {decision.wait_s:g} s"
        case OnFailure.ISOLATE:
            return "isolating it"
        case OnFailure.SHUTDOWN:
            return "shutting down the system"
