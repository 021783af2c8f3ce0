"""Rates of the messages of a topic, over a window of the last ones."""

from __future__ import annotations

import statistics
from collections import deque
from itertools import pairwise

from composer.base.fast_dataclass import dataclass
from composer.runtime.metrics.message_rate import MessageRate


@dataclass(frozen=True, slots=True)
class RateStatistics:
    """A message rate. Periods are in seconds; ``window`` is the number of periods."""

    average_hz: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


class RateWindow:
    """The arrival times of the last ``size`` messages, and the rate of as many in whole bursts."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._times_s: deque[float] = deque(maxlen=size + 1)
        self._rate = MessageRate()

    def add(self, at_s: float) -> None:
        """Add the arrival time of a message, in seconds."""
        self._times_s.append(at_s)
        self._rate.add(at_s)

    def statistics(self) -> RateStatistics | None:
        """Return the rate, None before the second burst of messages."""
        self._rate.forget_beyond(self._size)
        average_hz = self._rate.hertz
        if average_hz is None:
            return None
        periods = [later - earlier for earlier, later in pairwise(self._times_s)]
        return RateStatistics(
            average_hz=average_hz,
            shortest_s=min(periods),
            longest_s=max(periods),
            deviation_s=statistics.pstdev(periods),
            window=len(periods),
        )
