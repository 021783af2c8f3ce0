"""What a node may do in its lifecycle state, and the futures that it waits for meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any, TypeVar

from composer.behavior import CallCancelled
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.futures import Future

T = TypeVar("T")


class PendingFutures:
    """Futures that a node waits for, each with a deadline, all on one timer.

    Nearly every call is answered long before its deadline: a timer per call would cost more than
    the call. Methods may be called from any thread.
    """

    __slots__ = ("_discard", "_futures", "_loop", "_next_check_s")

    def __init__(self, loop: BaseLoop) -> None:
        self._loop = loop
        self._futures: dict[Future[Any], tuple[float, Callable[[], BaseException]]] = {}
        self._discard: Callable[[Future[Any]], object] = lambda done: self._futures.pop(done, None)
        self._next_check_s = inf  # the timer fires no later

    def add(
        self,
        future: Future[T],
        until_s: float = inf,
        timeout_error: Callable[[], BaseException] = TimeoutError,
    ) -> Future[T]:
        """Fail ``future`` with ``timeout_error()`` unless it is done by ``until_s``; return it.

        ``until_s`` is a time of the loop's clock.
        """
        self._futures[future] = until_s, timeout_error
        future.add_done_callback(self._discard)
        if until_s < self._next_check_s:
            self._check_at(until_s)
        return future

    def fail_all(self, reason: Callable[[], BaseException]) -> None:
        """Fail every pending future with ``reason()``."""
        for future in self._futures.copy():
            future.set_exception(reason())

    def _check_at(self, when_s: float) -> None:
        self._next_check_s = when_s
        self._loop.call_later(when_s - self._loop.clock.monotonic(), self._check)

    def _check(self) -> None:
        self._next_check_s = inf
        now_s = self._loop.clock.monotonic()
        for future, (until_s, timeout_error) in self._futures.copy().items():
            if until_s <= now_s:
                future.set_exception(timeout_error())
        next_s = min((until_s for until_s, _ in self._futures.copy().values()), default=inf)
        if next_s < self._next_check_s:
            self._check_at(next_s)


class LifecycleGate:
    """Three flags that say what a node may do, and the futures that end with them.

    ``incoming`` is true only in *active*: messages, requests, goals and timer calls are handled.
    ``outgoing`` is true from the start of *activating* to the end of *deactivating*, so lifecycle
    handlers may publish, call and send goals. ``waiting`` is also true during any other
    transition: a lifecycle handler may sleep.
    """

    __slots__ = (
        "_node",
        "_unblocked_outgoing",
        "generation",
        "incoming",
        "outgoing",
        "pending",
        "state",
        "waiting",
    )

    def __init__(self, node: str, pending: PendingFutures) -> None:
        """``pending`` holds the futures that fail when the node leaves *active*."""
        self._node = node
        self._unblocked_outgoing: bool | None = None  # None unless blocked
        self.pending = pending
        self.incoming = False
        self.outgoing = False
        self.waiting = False
        self.state = "unconfigured"
        self.generation = 0  # how often the pending futures were canceled

    @property
    def refusal(self) -> str:
        """Why nothing passes now."""
        if self._unblocked_outgoing is not None:
            return f"{self._node} has failed"
        return f"{self._node} is {self.state}, not active"

    def block(self) -> None:
        """Let nothing pass until the next transition: the node has failed. From any thread."""
        self._unblocked_outgoing = self.outgoing
        self.incoming = self.outgoing = False

    def unblock_outgoing(self) -> None:
        """Restore ``outgoing`` for the handlers of the next transition; nothing comes in."""
        if self._unblocked_outgoing is not None:
            self.outgoing = self._unblocked_outgoing
            self._unblocked_outgoing = None

    def open(self) -> None:
        """Let everything pass."""
        self._unblocked_outgoing = None
        self.incoming = self.outgoing = self.waiting = True

    def close(self) -> None:
        """Let nothing pass and cancel the pending futures."""
        self._unblocked_outgoing = None
        self.incoming = self.outgoing = self.waiting = False
        self.cancel_pending()

    def cancel_pending(self) -> None:
        """Fail all calls, goals and sleeps that the node waits for with CallCancelled."""
        self.generation += 1
        self.pending.fail_all(lambda: CallCancelled(self.refusal))
