"""How client ports wait for servers and answers: with a limit, and not beyond *active*."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import inf
from typing import Any, TypeVar

from composer.behavior import CallCancelled, CallTimeout, ServerUnavailable
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.tasks import Future, sleep, wrap_future

T = TypeVar("T")

#: rclpy does not tell when a server appears; looking costs microseconds.
_LOOK_EVERY_S = 0.01


class Waiting:
    """The time limit of one call. ``what`` names it in errors, for example ``service '/plan'``."""

    __slots__ = ("_core", "_end_s", "_period", "_timeout_ms", "_what")

    def __init__(self, core: NodeContext, what: str, timeout_ms: float | None) -> None:
        """Without ``timeout_ms`` there is no limit. Raises CallCancelled in the wrong state."""
        self._period = core.gate.period  # looked at first, so that no end of it is missed
        if not core.gate.outgoing:
            raise CallCancelled(core.gate.refusal)
        self._core = core
        self._what = what
        self._timeout_ms = timeout_ms
        self._end_s = inf if timeout_ms is None else time.monotonic() + timeout_ms / 1000.0

    async def until_there(self, is_there: Callable[[], bool]) -> None:
        """Wait for the server. Raises ServerUnavailable and CallCancelled."""
        while not is_there():
            if time.monotonic() >= self._end_s:
                raise ServerUnavailable(
                    f"no server of {self._what} was there within {self._timeout_ms:g} ms"
                )
            await self._held(sleep(self._core.loop, _LOOK_EVERY_S), inf)

    async def until_done(self, answer: Any) -> Any:
        """Return the outcome of a future, of ours or of rclpy's. Raises CallTimeout, CallCancelled.

        It is cancelled when it takes too long, so that the client forgets what it has asked. Where
        the node leaves *active* the answer may come: rclpy warns of answers that it has forgotten.
        """
        future = answer if isinstance(answer, Future) else wrap_future(answer)
        try:
            return await self.hold(future)
        except CallCancelled:
            raise
        except BaseException:
            answer.cancel()
            raise

    def hold(self, future: Future[T]) -> Future[T]:
        """Let ``future`` end in time, with CallTimeout or CallCancelled; return it."""
        return self._held(future, self._end_s)

    def _held(self, future: Future[T], until_s: float) -> Future[T]:
        gate = self._core.gate
        gate.pending.hold(future, until_s, self._too_late)
        if gate.period != self._period:  # the node has left *active* just now
            future.set_exception(CallCancelled(gate.refusal))
        return future

    def _too_late(self) -> CallTimeout:
        return CallTimeout(f"{self._what} did not answer within {self._timeout_ms:g} ms")
