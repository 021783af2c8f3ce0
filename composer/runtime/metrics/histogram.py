"""How long something took, counted for ever in a fixed amount of memory."""

from __future__ import annotations

import threading
from bisect import bisect, bisect_left
from collections.abc import Iterable
from itertools import accumulate, pairwise

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
BOUNDS_S = tuple(_bounds())

#: So many times are put into the histogram together.
TOGETHER = 256


class Durations:
    """A histogram of times in seconds.

    Who counts a million a second appends to ``waiting`` by itself, and calls :meth:`settle` at
    every :data:`TOGETHER`: a list is a place in memory that is near, buckets are not. Any thread
    may count and ask.
    """

    __slots__ = ("_buckets", "_lock", "_longest_s", "_total_s", "_weight", "waiting")

    def __init__(self) -> None:
        self.waiting: list[float] = []
        self._weight = 1
        self._buckets = [0] * (len(BOUNDS_S) + 1)
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
            settled = sorted(self.waiting)
            if not settled:
                return
            # Appended meanwhile, by others, is what comes behind them.
            del self.waiting[: len(settled)]
            self._count(settled)
            self._total_s += sum(settled) * self._weight
            self._longest_s = max(self._longest_s, settled[-1])

    def _count(self, settled: list[float]) -> None:
        """Count what is sorted: to look for the ends of buckets is quicker than for each time."""
        counted = 0
        for bucket in range(bisect(BOUNDS_S, settled[0]), bisect(BOUNDS_S, settled[-1])):
            below = bisect_left(settled, BOUNDS_S[bucket])
            self._buckets[bucket] += (below - counted) * self._weight
            counted = below
        self._buckets[bisect(BOUNDS_S, settled[-1])] += (len(settled) - counted) * self._weight

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
        return sum(self._buckets)

    @property
    def mean_s(self) -> float:
        """The mean; 0 when there were none."""
        return self.total_s / max(1, self.count)

    def percentile_s(self, share: float) -> float:
        """Return what ``share`` (0 to 1) of them do not exceed, within 10 %; 0 without any."""
        self.settle()
        counted = list(accumulate(self._buckets))
        if not counted[-1]:
            return 0.0
        rank = share * counted[-1]
        index = next(index for index, below in enumerate(counted) if below >= rank and below)
        return min(self._longest_s, _MIDDLES_S[index])


_MIDDLES_S = (
    _SHORTEST_S,
    *(before + (after - before) / 2.0 for before, after in pairwise(BOUNDS_S)),
    float("inf"),
)
