"""How the work of an operation grows with the size of its input."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable

import pytest

_ATTEMPTS = 5
_ITERATIONS = 60_000


def assert_linear(operation: Callable[[int], object], small: int, large: int) -> None:
    """Fail if ``operation(large)`` takes much more than ``large / small`` times as much work.

    Work in C cannot be counted, so it is the time of a processor that this thread uses. Both sizes
    are measured one after the other, several times: what is slow by chance is not so every time.
    """
    ratios: list[float] = []
    for _ in range(_ATTEMPTS):
        # The first time also loads and caches what is needed once.
        small_s = min(_seconds(operation, small) for _ in range(2))
        ratios.append(_seconds(operation, large) / small_s)
        if ratios[-1] < 2.5 * large / small:
            return
    pytest.fail(f"{large // small} times the size takes {ratios} times the work")


def assert_fast(operation: Callable[[], object], loops: float) -> None:
    """Fail if ``operation`` takes more than ``loops`` times as long as a fixed loop.

    The loop runs before and after it, as the speed of a processor changes with what else it does.
    """
    ratios: list[float] = []
    for _ in range(_ATTEMPTS):
        before_s = _seconds(_loop, _ITERATIONS)
        operation_s = _seconds(lambda _: operation(), 0)
        loop_s = (before_s + _seconds(_loop, _ITERATIONS)) / 2
        ratios.append(operation_s / loop_s)
        if ratios[-1] <= loops:
            return
    pytest.fail(f"it takes as long as {ratios} loops, more than {loops}")


def _loop(iterations: int) -> None:
    found: dict[str, tuple[int, object, list[int]]] = {}
    for number in range(iterations):
        found[str(number % 500)] = (number, found.get(str(number % 499)), [number])


def _seconds(operation: Callable[[int], object], size: int) -> float:
    gc.disable()  # a search takes the time that all objects of the tests need
    try:
        start_s = time.thread_time()
        operation(size)
        return time.thread_time() - start_s
    finally:
        gc.enable()
