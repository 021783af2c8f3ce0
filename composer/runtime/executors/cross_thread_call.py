"""A function handed to another thread, and the wait for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar, cast

from composer.runtime.executors.tasks import name_of

T = TypeVar("T")


class Handover(Generic[T]):
    """Calls ``function`` on the thread that calls :meth:`call`, for one that waits."""

    def __init__(self, function: Callable[[], T]) -> None:
        self._function = function
        self._right_to_begin = [True]  # popping is atomic: begun or called off, never both
        self._done = threading.Event()
        self._value: T | None = None
        self._error: BaseException | None = None

    def call(self) -> None:
        """Call the function, unless it was called off. Raises nothing."""
        if not self.call_off():
            return
        try:
            self._value = self._function()
        except BaseException as error:
            self._error = error
        self._done.set()

    def call_off(self) -> bool:
        """Take away the right to begin; false when it has begun or was called off."""
        try:
            self._right_to_begin.pop()
        except IndexError:
            return False
        return True

    def wait(self, timeout_s: float | None, where: Callable[[], str]) -> T:
        """Return what the function returns, or raise what it raises.

        Raises TimeoutError when that takes longer, with the stack ``where`` gives; the function
        is not begun after that.
        """
        if not self._done.wait(timeout_s):
            begun = "is still running" if not self.call_off() else "was not begun"
            stack = where()
            at = f"; the loop is at:\n{stack}" if stack else ""
            name = name_of(self._function)
            raise TimeoutError(f"'{name}' {begun} after {timeout_s:g} s{at}")
        if self._error is not None:
            raise self._error
        return cast(T, self._value)
