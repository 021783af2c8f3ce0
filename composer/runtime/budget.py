"""Names the callbacks that take longer than they may: ``budget_ms`` of a port or timer."""

from __future__ import annotations

from collections.abc import Coroutine
from time import monotonic
from typing import Any, TypeVar

from composer.runtime.core import Core
from composer.runtime.line import Work
from composer.source import Located

T = TypeVar("T")

#: A callback that is always late is named once in so long, not at every call.
AGAIN_AFTER_S = 5.0


class _Overruns:
    """How often, and how badly, one callback went over its budget."""

    def __init__(self, core: Core, name: str, budget_s: float) -> None:
        self._core = core
        self._name = name
        self._budget_s = budget_s
        self._count = 0
        self._longest_s = 0.0
        self._quiet_until_s = 0.0

    def take(self, took_s: float, now_s: float) -> None:
        """Count a call that took too long, and say so unless that was said just now."""
        self._count += 1
        self._longest_s = max(self._longest_s, took_s)
        if now_s < self._quiet_until_s:
            return
        self._quiet_until_s = now_s + AGAIN_AFTER_S
        self._core.log.warn(
            f"{self._name} took {took_s * 1e3:.1f} ms, over its budget of "
            f"{self._budget_s * 1e3:g} ms ({self._count} times so far, at most "
            f"{self._longest_s * 1e3:.1f} ms)"
        )


def within_budget(
    core: Core, name: str, budget_ms: Located[float] | None, work: Work[T]
) -> Work[T]:
    """Return ``work``, watched where a budget is declared.

    Measured is how long it keeps its thread: until it returns or, where it is ``async``, first
    waits.
    """
    if budget_ms is None:
        return work
    budget_s = budget_ms.value / 1e3
    overruns = _Overruns(core, name, budget_s)

    def watched(item: T) -> Coroutine[Any, Any, None] | None:
        began_s = monotonic()
        try:
            return work(item)
        finally:
            now_s = monotonic()
            if now_s - began_s > budget_s:
                overruns.take(now_s - began_s, now_s)

    return watched
