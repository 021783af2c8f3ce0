"""How client ports wait for servers and answers: with a limit, and not beyond *active*."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from composer.behavior import CallCancelled, CallTimeout, ServerUnavailable
from composer.runtime.core import Core
from composer.runtime.tasks import Future, sleep, within

#: rclpy does not tell when a server appears; looking costs microseconds.
_LOOK_EVERY_S = 0.01


class Waiting:
    """The time limit of one call. ``what`` names it in errors, for example ``service '/plan'``."""

    def __init__(self, core: Core, what: str, timeout_ms: float | None) -> None:
        """Without ``timeout_ms`` there is no limit. Raises CallCancelled in the wrong state."""
        if not core.gate.outgoing:
            raise CallCancelled(core.gate.refusal)
        self._core = core
        self._period = core.gate.period
        self._what = what
        self._timeout_ms = timeout_ms
        self._end_s = None if timeout_ms is None else time.monotonic() + timeout_ms / 1000.0

    async def until_there(self, is_there: Callable[[], bool]) -> None:
        """Wait for the server. Raises ServerUnavailable and CallCancelled."""
        while not is_there():
            if self._end_s is not None and time.monotonic() >= self._end_s:
                raise ServerUnavailable(
                    f"no server of {self._what} was there within {self._timeout_ms:g} ms"
                )
            await self._hold(sleep(self._core.loop, _LOOK_EVERY_S))

    async def until_done(self, future: Future[Any]) -> Any:
        """Return the outcome of ``future``. Raises CallTimeout and CallCancelled.

        ``future`` is cancelled when it is not waited for any more.
        """
        self._hold(future)
        if self._end_s is None:
            return await future
        try:
            return await within(self._core.loop, future, max(0.0, self._end_s - time.monotonic()))
        except TimeoutError as error:
            raise CallTimeout(
                f"{self._what} did not answer within {self._timeout_ms:g} ms"
            ) from error

    def _hold(self, future: Future[Any]) -> Future[Any]:
        """Let ``future`` end when the node leaves *active*, also if it has left it just now."""
        if self._core.gate.period != self._period:
            future.set_exception(CallCancelled(self._core.gate.refusal))
            return future
        return self._core.gate.hold(future)
