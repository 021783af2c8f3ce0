"""How the time of an operation grows with the size of its input."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable

import pytest


def assert_linear(operation: Callable[[int], object], small: int, large: int) -> None:
    """Fail if ``operation(large)`` takes much more than ``large / small`` times as long."""
    small_s = min(_seconds(operation, small) for _ in range(3))
    ratios: list[float] = []
    for _ in range(3):  # what is slow by chance is not so three times
        ratios.append(_seconds(operation, large) / small_s)
        if ratios[-1] < 3 * large / small:
            return
    pytest.fail(f"{large // small} times the size takes {ratios} times the time")


def _seconds(operation: Callable[[int], object], size: int) -> float:
    gc.collect()
    start_s = time.process_time()
    operation(size)
    return time.process_time() - start_s
