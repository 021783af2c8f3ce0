"""Handles failures of nodes as their policies say, see :func:`composer.plan.decide`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial

from composer.model import OnFailure, PrimaryState
from composer.model.lifecycle import FINALIZED
from composer.plan import Decision, DesiredState, Fault, FaultKind, Plan, Restart, Step, decide
from composer.runtime.supervision.events import NodeFailed
from composer.runtime.supervision.main_queue import LoopRecovered
from composer.runtime.supervision.phases import ExecutionOptions
from composer.runtime.supervision.reconciler import Reconciler

_DOWN = (PrimaryState.UNCONFIGURED, FINALIZED)


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
                return state not in _DOWN
            case FaultKind.SILENCE | FaultKind.ERRORS:
                return state != PrimaryState.ACTIVE
            case FaultKind.REPORTED:
                return state in _DOWN
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
