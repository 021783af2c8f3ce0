"""What users have written for a port, called so that nothing of it hurts anybody else."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from time import monotonic
from typing import Any, Final

from composer.runtime.core import Core
from composer.runtime.tracing import CallbackTimer
from composer.runtime.user_code import calls_user_code

#: What is handed to a handler without an argument.
NOTHING: Final = object()


class Callback:
    """Calls a handler: what it raises is a fault of ``name``, what it takes is counted."""

    __slots__ = ("_core", "_handle", "_name", "_timer")

    def __init__(
        self, core: Core, name: str, handle: Callable[..., Any], timer: CallbackTimer
    ) -> None:
        self._core = core
        self._name = name
        self._handle = handle
        self._timer = timer

    @calls_user_code
    def _call(self, message: Any) -> Coroutine[Any, Any, None] | None:
        """Have ``message`` handled; return the rest of that, where it is ``async``."""
        timer = self._timer
        began_s = 0.0
        if timer.pause > 0.0:  # two threads may both count down the last
            timer.pause -= 1
        else:
            began_s = monotonic()
        try:
            result = self._handle() if message is NOTHING else self._handle(message)
        except BaseException as error:
            self._core.faults.take(self._name, error)
            result = None
        rest = None if result is None else self._core.rest_of(self._name, result)
        return timer.took(began_s, rest) if began_s else rest
