"""Names the callbacks that take longer than they may: ``budget_ms`` of a port or timer."""

from __future__ import annotations

from time import monotonic

from composer.runtime.callbacks.log import Log
from composer.runtime.metrics.statistics import CallbackStatistics

#: A callback that is always late is named once in so long, not at every call.
AGAIN_AFTER_S = 5.0


class Budget:
    """Counts the calls of one callback that took too long, and names it."""

    def __init__(self, log: Log, callback: CallbackStatistics, budget_s: float) -> None:
        self._log = log
        self._callback = callback
        self._budget_s = budget_s
        self._quiet_until_s = 0.0

    def take(self, took_s: float) -> None:
        """Count a call that took too long, and say so unless that was said just now."""
        callback = self._callback
        callback.overruns += 1
        now_s = monotonic()
        if now_s < self._quiet_until_s:
            return
        self._quiet_until_s = now_s + AGAIN_AFTER_S
        self._log.warn(
            f"{callback} took {took_s * 1e3:.1f} ms, over its budget of "
            f"{self._budget_s * 1e3:g} ms ({callback.overruns} times so far, at most "
            f"{callback.times.longest_s * 1e3:.1f} ms)"
        )
