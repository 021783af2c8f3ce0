"""A histogram of durations, in constant memory."""

from __future__ import annotations

import math
import threading
from bisect import bisect, bisect_left
from collections.abc import Iterable
from itertools import accumulate, pairwise

_SHORTEST_S = 1e-7
_LONGEST_S = 100.0
#: Each bucket is a fifth longer than the one before: a percentile is right within 10 %.
_GROWTH = 1.2


def _bounds() -> Iterable[float]:
    bound_s = _SHORTEST_S
    while bound_s < _LONGEST_S:
        yield bound_s
        bound_s *= _GROWTH


#: The bounds of buckets, in seconds: bucket ``i`` ends at ``BOUNDS_S[i]``; the last is unbounded.
BOUNDS_S = tuple(_bounds())

#: How many durations are added to the buckets together.
BATCH_SIZE = 256


class Histogram:
    """A histogram of durations in seconds. Any thread may add and read.

    Code that counts a million durations per second appends to ``batch`` itself, and calls
    :meth:`flush` every :data:`BATCH_SIZE`: a list stays in the cache, buckets do not.
    """

    __slots__ = ("_buckets", "_lock", "_longest_s", "_total_s", "_weight", "batch")

    def __init__(self) -> None:
        self.batch: list[float] = []
        self._weight = 1
        self._buckets = [0] * (len(BOUNDS_S) + 1)
        self._total_s = 0.0
        self._longest_s = 0.0
        self._lock = threading.Lock()

    def add(self, duration_s: float) -> None:
        """Add a duration."""
        self.batch.append(duration_s)
        if len(self.batch) >= BATCH_SIZE:
            self.flush()

    def flush(self) -> None:
        """Add the batch to the buckets."""
        with self._lock:
            added = sorted(self.batch)
            if not added:
                return
            # Other threads may append meanwhile, behind these.
            del self.batch[: len(added)]
            self._count(added)
            self._total_s += sum(added) * self._weight
            self._longest_s = max(self._longest_s, added[-1])

    def _count(self, durations: list[float]) -> None:
        """Count sorted durations: one search per bucket is faster than one per duration."""
        counted = 0
        for bucket in range(bisect(BOUNDS_S, durations[0]), bisect(BOUNDS_S, durations[-1])):
            below = bisect_left(durations, BOUNDS_S[bucket])
            self._buckets[bucket] += (below - counted) * self._weight
            counted = below
        last = bisect(BOUNDS_S, durations[-1])
        self._buckets[last] += (len(durations) - counted) * self._weight

    def set_weight(self, weight: int) -> None:
        """Count each duration that is added from now on ``weight`` times."""
        if weight != self._weight:
            self.flush()
            self._weight = weight

    @property
    def total_s(self) -> float:
        """The sum of all durations."""
        with self._lock:  # without flushing: this is read every second
            return self._total_s + sum(self.batch) * self._weight

    @property
    def longest_s(self) -> float:
        """The longest duration; 0 without any."""
        self.flush()
        return self._longest_s

    @property
    def count(self) -> int:
        """The number of durations."""
        self.flush()
        return sum(self._buckets)

    @property
    def mean_s(self) -> float:
        """The mean; 0 without any."""
        return self.total_s / max(1, self.count)

    @property
    def text(self) -> str:
        """The buckets that are not empty, with their counts: ``45:3 46:12``."""
        self.flush()
        return " ".join(f"{index}:{count}" for index, count in enumerate(self._buckets) if count)

    def percentile_s(self, share: float) -> float:
        """Return the duration that ``share`` (0 to 1) of them do not exceed, within 10 %; or 0."""
        self.flush()
        counted = list(accumulate(self._buckets))
        if not counted[-1]:
            return 0.0
        rank = share * counted[-1]
        index = next(index for index, below in enumerate(counted) if below >= rank and below)
        return min(self._longest_s, _MIDDLES_S[index])


def parse_buckets(text: str) -> list[tuple[float, int]]:
    """Return the bounds of the buckets in :attr:`Histogram.text`, in seconds, and the counts.

    The longest durations have no bound: infinity. Raises ValueError.
    """
    buckets = []
    for item in text.split():
        index, _, count = item.partition(":")
        bucket = int(index)
        if not 0 <= bucket <= len(BOUNDS_S):
            raise ValueError(f"there is no bucket {bucket}")
        buckets.append((BOUNDS_S[bucket] if bucket < len(BOUNDS_S) else math.inf, int(count)))
    return buckets


_MIDDLES_S = (
    _SHORTEST_S,
    *(before + (after - before) / 2.0 for before, after in pairwise(BOUNDS_S)),
    float("inf"),
)
