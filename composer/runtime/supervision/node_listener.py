"""Receives what nodes report, on their threads, and passes each report on once."""

from __future__ import annotations

from collections.abc import Callable

from composer.model import LogLevel, Node, PrimaryState
from composer.plan import Fault, FaultKind
from composer.runtime.node.lifecycle import FINALIZED, TransitionOutcome
from composer.runtime.supervision import events
from composer.runtime.supervision.main_queue import ExternalTransition, Item, MainQueue
from composer.runtime.supervision.status import Status

#: The state that each transition ends in if it succeeds.
_GOALS = {
    "configure": PrimaryState.INACTIVE,
    "activate": PrimaryState.ACTIVE,
    "deactivate": PrimaryState.INACTIVE,
    "cleanup": PrimaryState.UNCONFIGURED,
    "shutdown": FINALIZED,
}
_DOWN = (PrimaryState.UNCONFIGURED, FINALIZED)


class SupervisionListener:
    """Reports one node's transitions and errors to the status, the user and the main queue.

    Faults and external transitions go to the main queue. A transition of a plan does not: the plan
    executor waits for its result.
    """

    def __init__(
        self,
        node: Node,
        is_moving: Callable[[str], bool],
        main_queue: MainQueue[Item],
        status: Status,
        reporter: events.Reporter,
    ) -> None:
        """``is_moving(node)`` returns whether a plan moves the node now."""
        self._name = node.name.value
        self._full_name = node.full_name
        self._is_moving = is_moving
        self._main_queue = main_queue
        self._status = status
        self._reporter = reporter

    def on_transition_end(self, result: TransitionOutcome) -> None:
        """Report the new state."""
        at_s = self._reporter.elapsed_s
        transition, state = result.transition, result.state
        self._status.set_state(self._name, state)
        self._reporter.report(events.StateChanged(at_s, self._full_name, transition, state))
        if self._is_moving(self._name):
            return
        if state == _GOALS[transition]:
            self._main_queue.put(ExternalTransition(self._name, state))
        elif state in _DOWN:
            text = f"{transition} ended in an error: {result.reason}"
            self._main_queue.put(Fault(self._name, FaultKind.TRANSITION, text))

    def on_error(self, callback: str, text: str) -> None:
        """Report an error of user code."""
        self._status.set_error(self._name, f"{callback}: {text}")
        at_s = self._reporter.elapsed_s
        self._reporter.report(events.CallbackFailed(at_s, self._full_name, callback, text))

    def on_error_limit(self, text: str) -> None:
        """Report that the node has exceeded its ``max_errors``."""
        self._main_queue.put(Fault(self._name, FaultKind.ERRORS, text))

    def write_log(self, level: LogLevel, logger: str, message: str) -> None:
        """Report a line of the log."""
        self._reporter.log(level, logger, message)
