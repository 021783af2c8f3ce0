"""Keeps a system up: brings it up as a whole or not at all, deals with faults, obeys commands.

What is to be done is decided in :mod:`composer.plan`; here it is done, on the main thread, one
thing after the other.
"""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

from composer.model import OnFailure, PrimaryState, System
from composer.model.dependencies import dependents
from composer.plan import (
    Decision,
    DesiredState,
    Fault,
    FaultKind,
    Plan,
    Step,
    decide,
    desired_states,
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
from composer.runtime.supervision.health_monitor import Hanging, LoopRecovered
from composer.runtime.supervision.main_queue import MainQueue
from composer.runtime.supervision.node_set import FINALIZED, CreationFailed, NodeSet
from composer.runtime.supervision.plan_executor import ExecutionOptions, PlanExecutor, StepFailed
from composer.runtime.supervision.reporter import Reporter
from composer.runtime.supervision.status import Status

_PRIMARY = {state.value: state for state in PrimaryState}
_DOWN = (PrimaryState.UNCONFIGURED.value, FINALIZED)
_LENIENT = ExecutionOptions(lenient=True)


@dataclass(frozen=True, slots=True)
class ExternalTransition:
    """Somebody outside has taken a node to another state. ``node`` is a key, ``state`` a label."""

    node: str
    state: str


class Supervisor:
    """What has to be kept up, and what was done about it so far."""

    def __init__(
        self,
        system: System,
        node_set: NodeSet,
        main_queue: MainQueue[object],
        status: Status,
        reporter: Reporter,
    ) -> None:
        self._system = system
        self._node_set = node_set
        self._main_queue = main_queue
        self._status = status
        self._reporter = reporter
        self._plan_executor = PlanExecutor(node_set, main_queue, self._tell_failed)
        self._upkeep = DesiredState(dict.fromkeys(node_set.nodes, PrimaryState.UNCONFIGURED))
        self._due: list[tuple[float, str, int]] = []  # when to restart which node, what attempt
        self._stranded: dict[str, set[str]] = {}  # by hung loop: nodes that did nothing wrong

    @property
    def moving(self) -> set[str]:
        """The nodes that are being moved now; where they come to rest is no news."""
        return self._plan_executor.moving

    @property
    def goals(self) -> Mapping[str, PrimaryState]:
        """Where the nodes are wanted, by their keys."""
        return self._upkeep.goals

    @property
    def has_failed_nodes(self) -> bool:
        """Whether a node is held down, or gave the system up."""
        return bool(self._upkeep.down)

    # --- the whole system

    def want(self, goals: Mapping[str, PrimaryState], *, forget: bool = False) -> None:
        """Say where nodes are wanted from now on; with ``forget``, failures are history."""
        self._upkeep = self._upkeep.with_goals(goals)
        if forget:
            self._upkeep = DesiredState(self._upkeep.goals)
            self._due.clear()
        self._show()

    def bring_up(self, plan: Plan, within_s: float = math.inf) -> str | None:
        """Carry out a plan as a whole or not at all; return why it failed, or None.

        What it had done by then is undone in reverse.
        """
        before = self._node_set.states()
        end_s = time.monotonic() + within_s
        failures = self._plan_executor.carry_out(plan, ExecutionOptions(end_s=end_s))
        if not failures:
            return None
        step = failures[0].step
        reason = f"it did not {step.transition}: {failures[0].reason}"
        if time.monotonic() >= end_s:
            reason = f"it did not {step.transition} in time: {within_s:g} s are over"
        self._roll_back(before, step.full_name, reason)
        return f"{step.full_name}: {reason}"

    def mend(self, why: str) -> tuple[StepFailed, ...]:
        """Take every node to where it is wanted now; failures on the way become faults."""
        return self._reach(self._upkeep, self._node_set.states(), why)

    def _mend_settled(self, why: str = "") -> tuple[StepFailed, ...]:
        """Do the same with all nodes but those that have just failed or been moved, too.

        They would be brought up again before anybody has dealt with that.
        """
        return self._reach(self._upkeep, self._node_set.settled(), why)

    def _reach(
        self, upkeep: DesiredState, states: Mapping[str, PrimaryState], why: str
    ) -> tuple[StepFailed, ...]:
        plan = reconcile(self._system, upkeep, states, why)
        failures = self._plan_executor.carry_out(plan, _LENIENT)
        for failure in failures:
            if failure.step.node not in self._upkeep.down:
                self._main_queue.put(_fault_of(failure))
        self._show()
        return failures

    def tear_down(self, steps: Plan, end_s: float, share_s: float) -> bool:
        """Take everything down, whatever becomes of it; return whether nothing failed."""
        manner = ExecutionOptions(lenient=True, stoppable=False, end_s=end_s, share_s=share_s)
        return not self._plan_executor.carry_out(steps, manner)

    def _roll_back(self, before: Mapping[str, PrimaryState], node: str, reason: str) -> None:
        tell = self._reporter.tell
        tell(RollingBack(self._reporter.elapsed_s, node, reason))
        causes = dict.fromkeys(self._node_set.nodes, f"{node} failed")
        plan = plan_transitions(self._system, self._node_set.states(), before, causes)
        self._plan_executor.carry_out(plan, _LENIENT)
        undone = tuple(dict.fromkeys(step.full_name for step in plan.steps))
        tell(RolledBack(self._reporter.elapsed_s, undone))

    # --- what happens to nodes

    def next_restart_s(self) -> float | None:
        """Return when ``time.monotonic()`` says that a node is to be restarted; None: none is."""
        return self._due[0][0] if self._due else None

    def restart_due(self) -> None:
        """Restart the node whose wait is over first."""
        _, name, attempt = heapq.heappop(self._due)
        if name not in self._upkeep.down:
            return  # somebody else has brought it up
        now_s = time.monotonic()
        self._upkeep = self._upkeep.restart(name, now_s)
        self._status.count_restart(name)
        try:
            self._node_set.revive(name)
        except CreationFailed as error:
            self.take_fault(Fault(name, FaultKind.TRANSITION, str(error), now_s))
            return
        full_name = self._node_set.nodes[name].full_name
        if (
            not self._mend_settled(f"restart {attempt} of {full_name}")
            and not self._main_queue.closing
        ):
            self._reporter.tell(Restarted(self._reporter.elapsed_s, full_name, attempt))

    def take_fault(self, fault: Fault) -> None:
        """Do what is to be done about a failed node."""
        self._node_set.left[fault.node] = self._node_set.nodes[fault.node].state
        verdict = decide(self._system, self._upkeep, fault)
        if verdict is None or self._is_overtaken(fault):
            return
        node = self._node_set.nodes[fault.node]
        self._status.set_error(fault.node, fault.text)
        self._reporter.tell(
            NodeFailed(
                self._reporter.elapsed_s, node.full_name, fault.text, self._consequence(verdict)
            )
        )
        self._upkeep = self._upkeep.fail(fault)
        if fault.kind is FaultKind.LOST:
            node.give_up()
            self._strand(fault.node)
        if verdict.action is OnFailure.SHUTDOWN:
            self._show()
            self._main_queue.ask(f"{node.full_name} failed: {verdict.reason}")
            return
        self._mend_settled()
        self._force_down(fault.node)
        if self._node_set.is_lost(fault.node) and fault.kind is not FaultKind.LOST:
            self._upkeep = self._upkeep.release(fault.node)
            self.take_fault(replace(fault, kind=FaultKind.LOST))
        elif verdict.action is OnFailure.RESTART:
            due_s = time.monotonic() + verdict.wait_s
            heapq.heappush(self._due, (due_s, fault.node, verdict.attempt))

    def take_move(self, moved: ExternalTransition) -> None:
        """Accept that somebody outside wants a node elsewhere.

        Only dependents are moved in consequence: transitions of others may still be queued.
        """
        if self._node_set.nodes[moved.node].state != moved.state:
            return  # it has gone on since, and that is news of its own
        self._node_set.left[moved.node] = moved.state
        states = self._node_set.states()
        state = _PRIMARY.get(moved.state, PrimaryState.UNCONFIGURED)
        self._upkeep = self._upkeep.release(moved.node).with_goals({moved.node: state})
        needing = dependents(self._system, moved.node)
        still = {name: at for name, at in states.items() if name not in needing}
        self._reach(self._upkeep.with_goals(still), states, f"{moved.node} was moved by hand")

    def take_hanging(self, hanging: Hanging) -> None:
        """Tell of a callback that takes too long, and is being interrupted."""
        full_name = self._node_set.nodes[hanging.node].full_name
        what = f"return from {hanging.callback} within {1000.0 * hanging.limit_s:g} ms"
        self._reporter.tell(Stuck(self._reporter.elapsed_s, full_name, what, hanging.stack))

    def take_return(self, returned: LoopRecovered) -> None:
        """Go on with the nodes of a loop that had been given up."""
        if returned.loop not in self._node_set.hung:
            return
        self._node_set.hung.discard(returned.loop)
        for name in self._stranded.pop(returned.loop, ()):
            self._upkeep = self._upkeep.release(name)
        self._mend_settled(f"executor '{returned.loop}' goes on")

    def _is_overtaken(self, fault: Fault) -> bool:
        """Say whether somebody has taken the node elsewhere since it failed."""
        state = self._node_set.nodes[fault.node].state
        match fault.kind:
            case FaultKind.TRANSITION:
                return state not in _DOWN
            case FaultKind.SILENCE | FaultKind.ERRORS:
                return state != PrimaryState.ACTIVE.value
            case _:
                return False

    def _consequence(self, verdict: Decision) -> str:
        match verdict.action:
            case OnFailure.RESTART:
                return f"restart {verdict.attempt} in {verdict.wait_s:g} s"
            case OnFailure.ISOLATE:
                return "it is isolated"
            case OnFailure.SHUTDOWN:
                return "the system is given up"

    def _strand(self, culprit: str) -> None:
        """Give up the loop of a node, and with it all other nodes it runs."""
        loop = self._node_set.nodes[culprit].loop.name
        self._node_set.hung.add(loop)
        full_name = self._node_set.nodes[culprit].full_name
        stranded = self._stranded.setdefault(loop, set())
        for name, node in self._node_set.nodes.items():
            if node.loop.name == loop and name not in self._upkeep.down:
                stranded.add(name)
                text = f"its executor hangs in {full_name}"
                fault = Fault(name, FaultKind.LOST, text, time.monotonic())
                self._upkeep = self._upkeep.fail(fault)
                self._status.set_error(name, text)

    def _force_down(self, name: str) -> None:
        """Shut down a failed node that refuses to go any other way.

        One that somebody else has taken up by now does not refuse.
        """
        node = self._node_set.nodes[name]
        if (
            self._node_set.settled().get(name, PrimaryState.UNCONFIGURED)
            is PrimaryState.UNCONFIGURED
        ):
            return
        step = Step(1, "shutdown", name, node.full_name, "it would not go down")
        self._plan_executor.carry_out(Plan((step,)), _LENIENT)

    def _tell_failed(self, failure: StepFailed) -> None:
        step = failure.step
        at_s = self._reporter.elapsed_s
        if failure.stuck:
            event = Stuck(at_s, step.full_name, step.transition, failure.stack)
            self._reporter.tell(event)
        else:
            self._reporter.tell(
                NodeTransitionFailed(
                    at_s, step.full_name, step.transition, failure.state, failure.reason
                )
            )

    def _show(self) -> None:
        goals = desired_states(self._system, self._upkeep)
        states = {name: state.value for name, state in goals.items()}
        self._status.set_wanted(states, self._upkeep.down)


def _fault_of(failure: StepFailed) -> Fault:
    text = f"it did not {failure.step.transition}: {failure.reason}"
    return Fault(failure.step.node, FaultKind.STEP, text, time.monotonic())
