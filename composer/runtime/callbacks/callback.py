"""What users have written for a port, called so that nothing of it hurts anybody else."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from time import monotonic
from typing import Any, Final

from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.user_code import calls_user_code
from composer.runtime.metrics.histogram import TOGETHER
from composer.runtime.metrics.statistics import CallbackStatistics
from composer.source import Located

_LAST = TOGETHER - 1  # whoever comes then has all of them counted
#: What is handed to a handler without an argument.
NOTHING: Final = object()


class Callback(CallbackTimer):
    """Calls a handler: what it raises is a fault of ``name``, what it takes is counted."""

    __slots__ = ("_core", "_handle", "_name")

    def __init__(
        self,
        core: NodeContext,
        name: str,
        handle: Callable[..., Any],
        statistics: CallbackStatistics,
        budget_ms: Located[float] | None,
    ) -> None:
        super().__init__(core, statistics, budget_ms)
        self._core = core
        self._name = name
        self._handle = handle

    @calls_user_code
    def _call(self, message: Any) -> Coroutine[Any, Any, None] | None:
        """Have ``message`` handled; return the rest of that, where it is ``async``."""
        began_s = 0.0
        if self.pause > 0.0:  # two threads may both count down the last
            self.pause -= 1
        else:
            began_s = monotonic()
        try:
            result = self._handle() if message is NOTHING else self._handle(message)
        except BaseException as error:
            self._core.error_log.exception(self._name, error)
            result = None
        rest = None if result is None else self._core.rest_of(self._name, result)
        if not began_s:
            return rest
        took_s = monotonic() - began_s
        waiting = self._waiting
        if rest is not None or took_s > self._budget_s or len(waiting) >= _LAST:
            return self.took(began_s, rest)
        waiting.append(took_s)  # as in took, but without a call
        self.pause = self._pause
        return None
