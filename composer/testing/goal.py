"""A goal that a test has sent to an action server of the system."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from composer.runtime.executors.futures import Future

#: Waits for a future, at most for a time; the text says for what.
WaitFor: TypeAlias = Callable[[Future[Any], float, str], Any]


class Goal:
    """A goal that a test has sent."""

    def __init__(
        self, wait_for: WaitFor, action: str, sent: Future[Any], feedback: Sequence[Any]
    ) -> None:
        self._wait_for = wait_for
        self._action = action
        self._sent = sent
        self._outcome: Future[Any] | None = None
        #: The feedback so far.
        self.feedback = feedback

    @property
    def is_accepted(self) -> bool | None:
        """Whether the server has accepted the goal; None as long as it has not answered."""
        if not self._sent.done():
            return None
        return self._sent.exception() is None

    def result(self, timeout_s: float = 60.0) -> Any:
        """Wait for the result; it has ``status`` and ``result``.

        Raises TestFailure after ``timeout_s``, and what the call raises, such as GoalRejected.
        """
        if self._outcome is None:
            sent = self._wait_for(self._sent, timeout_s, f"an answer of {self._action}")
            self._outcome = sent.result()
        return self._wait_for(self._outcome, timeout_s, f"the result of {self._action}")

    def cancel(self, timeout_s: float = 5.0) -> bool:
        """Request to cancel the goal; return whether the server accepts that."""
        sent = self._wait_for(self._sent, timeout_s, f"an answer of {self._action}")
        what = f"{self._action} to cancel the goal"
        return bool(self._wait_for(sent.cancel(), timeout_s, what))
