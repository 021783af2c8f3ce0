"""How long something took, counted for ever in a fixed amount of memory."""

from __future__ import annotations

import threading
from array import array
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

_SHORTEST_S = 1e-7
_LONGEST_S = 100.0
#: Each bucket reaches a fifth further than the one before: a percentile is right within 10 %.
_GROWTH = 1.2


def _bounds() -> Iterable[float]:
    bound_s = _SHORTEST_S
    while bound_s < _LONGEST_S:
        yield bound_s
        bound_s *= _GROWTH


#: The limits between buckets, in seconds: bucket ``i`` ends at ``BOUNDS_S[i]``, the last nowhere.
BOUNDS_S = np.array(tuple(_bounds()))
_BUCKETS = len(BOUNDS_S) + 1

#: So many times are put into the histogram together.
TOGETHER = 256


class Durations:
    """A histogram of times in seconds.

    Who counts a million a second appends to ``waiting`` by itself, and calls :meth:`settle` at
    every :data:`TOGETHER`: its end is a place in memory that is near, buckets are not. Any thread
    may count and ask.
    """

    __slots__ = ("_buckets", "_lock", "_longest_s", "_total_s", "_weight", "waiting")

    def __init__(self) -> None:
        self.waiting = array("d")
        self._weight = 1
        self._buckets = np.zeros(_BUCKETS, np.int64)
        self._total_s = 0.0
        self._longest_s = 0.0
        self._lock = threading.Lock()

    def take(self, took_s: float) -> None:
        """Count one."""
        self.waiting.append(took_s)
        if len(self.waiting) >= TOGETHER:
            self.settle()

    def settle(self) -> None:
        """Put what waits into the histogram."""
        with self._lock:
            waiting = self.waiting[:]  # by now: others may go on appending
            if not waiting:
                return
            del self.waiting[: len(waiting)]
            settled = np.frombuffer(waiting)
            counted = np.bincount(BOUNDS_S.searchsorted(settled, "right"), minlength=_BUCKETS)
            self._buckets += counted * self._weight
            self._total_s += float(settled.sum()) * self._weight
            self._longest_s = max(self._longest_s, float(settled.max()))

    def stand_for(self, weight: int) -> None:
        """Let each time that comes from now on count as ``weight`` of them."""
        if weight != self._weight:
            self.settle()
            self._weight = weight

    @property
    def total_s(self) -> float:
        """All of them together."""
        with self._lock:  # without settling: this is asked each second
            return self._total_s + sum(self.waiting) * self._weight

    @property
    def longest_s(self) -> float:
        """The longest; 0 when there were none."""
        self.settle()
        return self._longest_s

    @property
    def count(self) -> int:
        """How many there were."""
        self.settle()
        return int(self._buckets.sum())

    @property
    def mean_s(self) -> float:
        """The mean; 0 when there were none."""
        return self.total_s / max(1, self.count)

    def percentile_s(self, share: float) -> float:
        """Return what ``share`` (0 to 1) of them do not exceed, within 10 %; 0 without any."""
        self.settle()
        counted: list[int] = self._buckets.cumsum().tolist()
        if not counted[-1]:
            return 0.0
        rank = share * counted[-1]
        index = next(index for index, below in enumerate(counted) if below >= rank and below)
        return float(min(self._longest_s, _MIDDLES_S[index]))


_MIDDLES_S = (
    _SHORTEST_S,
    *(before + (after - before) / 2.0 for before, after in pairwise(BOUNDS_S.tolist())),
    float("inf"),
)
