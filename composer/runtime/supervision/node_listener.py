"""Receives what nodes report, on their threads, and passes each report on once."""

from __future__ import annotations

from composer.model import LogLevel, Node, PrimaryState
from composer.model.lifecycle import FINALIZED, TRANSITIONS
from composer.plan import Fault, FaultKind
from composer.plan.steps import REACHED
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.supervision import events
from composer.runtime.supervision.main_queue import (
    Item,
    NodeMoved,
    NodeReturned,
    SupervisionContext,
)

_DOWN = (PrimaryState.UNCONFIGURED, FINALIZED)


class SupervisionListener:
    """Reports one node's transitions and errors to the status, the user and the supervisor.

    The state that a requested transition ends in becomes the desired one, before the node answers
    the request or starts another transition. The main queue receives it too, because other nodes
    may have to move. The plan executor waits for the result of a step.
    """

    def __init__(self, node: Node, context: SupervisionContext) -> None:
        self._name = node.name.value
        self._full_name = node.full_name
        self._context = context
        self._last_state = ""

    def on_transition_end(self, result: TransitionOutcome) -> None:
        """Report the new state; record a requested transition first."""
        item = self._record(result) if result.requested else None
        state = result.state
        self._context.status.set_state(self._name, state)
        if state != self._last_state:  # otherwise, the transition has failed
            self._last_state = state
            self._context.reporter.report(
                events.StateChanged, self._full_name, result.transition, state
            )
        if item is not None:
            self._context.main_queue.put(item)

    def _record(self, result: TransitionOutcome) -> Item:
        """Record a requested transition; return the item for the supervisor."""
        name = self._name
        if result.state == TRANSITIONS[result.transition].goal:
            goal = REACHED[result.transition]
            self._context.desired.update(lambda desired: desired.move(name, goal))
        elif result.state in _DOWN:
            text = f"{result.transition} ended in an error: {result.reason}"
            serial = self._context.desired.update(lambda desired: desired.break_down(name)).serial
            return Fault(name, FaultKind.TRANSITION, text, serial)
        return NodeMoved(name, f"requested transition of {self._full_name}")

    def on_error(self, callback: str, text: str) -> None:
        """Report an error of user code."""
        self._context.status.set_error(self._name, f"{callback}: {text}")
        self._context.reporter.report(events.CallbackFailed, self._full_name, callback, text)

    def on_fault(self, kind: FaultKind, text: str) -> None:
        """Report that the node has failed: it says so, or has exceeded its ``max_errors``."""
        self._context.main_queue.put(
            Fault(self._name, kind, text, self._context.desired.value.serial)
        )

    def on_ended(self, text: str, state: str, *, is_awaited: bool = False) -> None:
        """Report that a node outside the process has ended by itself, and its new state.

        With ``is_awaited``, it cannot be started from here, and its return will be reported. No
        plan moves the node until the supervisor has handled the fault.
        """
        kind = FaultKind.ABSENT if is_awaited else FaultKind.ENDED
        fault = Fault(self._name, kind, text, self._context.desired.value.serial)
        self._context.desired.update(lambda desired: desired.await_fault(fault))
        self._context.status.set_state(self._name, state)
        self._last_state = state
        self._context.reporter.report(events.StateChanged, self._full_name, "end", state)
        self._context.main_queue.put(fault)

    def on_returned(self) -> None:
        """Report that a node that had disappeared by itself is there again."""
        self._context.main_queue.put(NodeReturned(self._name))

    def write_log(self, level: LogLevel, logger: str, message: str) -> None:
        """Report a line of the log."""
        self._context.reporter.log(level, logger, message)
