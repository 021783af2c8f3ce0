"""Calls a handler of user code so that its faults stay contained."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from time import monotonic
from typing import Any, Final

from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.timing import CallbackTimer
from composer.runtime.executors.stacks import calls_user_code
from composer.runtime.metrics.histogram import BATCH_SIZE
from composer.runtime.metrics.statistics import CallbackStatistics
from composer.source import Located

_LAST = BATCH_SIZE - 1  # the call that completes a batch
#: The message for a handler without an argument.
EMPTY: Final = object()


class Callback(CallbackTimer):
    """Calls a handler and times it; its exceptions are faults of ``name``."""

    __slots__ = ("_context", "_handle", "_name")

    def __init__(
        self,
        context: NodeContext,
        name: str,
        handle: Callable[..., Any],
        statistics: CallbackStatistics,
        budget_ms: Located[float] | None,
    ) -> None:
        super().__init__(context, statistics, budget_ms)
        self._context = context
        self._name = name
        self._handle = handle

    @calls_user_code
    def _call(self, message: Any) -> Coroutine[Any, Any, None] | None:
        """Handle ``message``; return the rest of the call if it is ``async``."""
        began_s = 0.0
        if self.to_skip > 0.0:  # two threads may both decrement the last one
            self.to_skip -= 1
        else:
            began_s = monotonic()
        try:
            result = self._handle() if message is EMPTY else self._handle(message)
            rest = None if result is None else self._context.continuation(self._name, result)
        except BaseException as error:
            self._context.error_log.exception(self._name, error)
            rest = None
        if not began_s:
            return rest
        duration_s = monotonic() - began_s
        batch = self._batch
        if rest is not None or duration_s > self._budget_s or len(batch) >= _LAST:
            return self.finish(began_s, rest)
        batch.append(duration_s)  # as in finish, without a call
        self.to_skip = self._skip
        return None
