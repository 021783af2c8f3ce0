"""What somebody in a node waits for, and for how long."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from time import monotonic
from typing import Any, TypeVar

from composer.runtime.executors.tasks import Future

T = TypeVar("T")

CallLater = Callable[[float, Callable[[], object]], object]


class Pending:
    """Futures that are waited for, each until its time, all of them on one timer.

    Nearly every call is answered long before its time is up: a timer of its own would cost more
    than the call. Methods may be called from any thread.
    """

    __slots__ = ("_call_later", "_forget", "_futures", "_look_s")

    def __init__(self, call_later: CallLater) -> None:
        self._call_later = call_later
        self._futures: dict[Future[Any], tuple[float, Callable[[], BaseException]]] = {}
        self._forget: Callable[[Future[Any]], object] = lambda done: self._futures.pop(done, None)
        self._look_s = inf  # the timer goes off by then

    def hold(
        self,
        future: Future[T],
        until_s: float = inf,
        too_late: Callable[[], BaseException] = TimeoutError,
    ) -> Future[T]:
        """Let ``future`` end with ``too_late()`` unless it is done by then; return it.

        ``until_s`` is a time of ``time.monotonic()``.
        """
        self._futures[future] = until_s, too_late
        future.add_done_callback(self._forget)
        if until_s < self._look_s:
            self._look_by(until_s)
        return future

    def end(self, reason: Callable[[], BaseException]) -> None:
        """Let everything that is waited for end with ``reason()``."""
        for future in self._futures.copy():
            future.set_exception(reason())

    def _look_by(self, when_s: float) -> None:
        self._look_s = when_s
        self._call_later(when_s - monotonic(), self._look)

    def _look(self) -> None:
        self._look_s = inf
        now_s = monotonic()
        for future, (until_s, too_late) in self._futures.copy().items():
            if until_s <= now_s:
                future.set_exception(too_late())
        next_s = min((until_s for until_s, _ in self._futures.copy().values()), default=inf)
        if next_s < self._look_s:
            self._look_by(next_s)
