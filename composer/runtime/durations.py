"""How long something took, counted for ever in a fixed amount of memory."""

from __future__ import annotations

from bisect import bisect
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


class Durations:
    """A histogram of times in seconds. One that counts allocates nothing.

    Its fields are public for who counts a million a second: see :meth:`take`. Two threads that
    count at the same time may lose one of the two.
    """

    __slots__ = ("buckets", "longest_s", "total_s")

    def __init__(self) -> None:
        self.buckets = [0] * (len(BOUNDS_S) + 1)
        self.total_s = 0.0
        self.longest_s = 0.0

    def take(self, took_s: float) -> None:
        """Count one."""
        self.buckets[bisect(BOUNDS_S, took_s)] += 1
        self.total_s += took_s
        self.longest_s = max(self.longest_s, took_s)

    @property
    def count(self) -> int:
        """How many there were."""
        return sum(self.buckets)

    @property
    def mean_s(self) -> float:
        """The mean; 0 when there were none."""
        return self.total_s / max(1, self.count)

    def percentile_s(self, share: float) -> float:
        """Return what ``share`` (0 to 1) of them do not exceed, within 10 %; 0 without any."""
        counted = list(accumulate(self.buckets))
        if not counted[-1]:
            return 0.0
        rank = share * counted[-1]
        index = next(index for index, below in enumerate(counted) if below >= rank and below)
        return min(self.longest_s, _MIDDLES_S[index])


_MIDDLES_S = (
    _SHORTEST_S,
    *(before + (after - before) / 2.0 for before, after in pairwise(BOUNDS_S)),
    float("inf"),
)
