"""Rates, sizes and delays of the messages of a topic, over a window of the last ones."""

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


@dataclass(frozen=True, slots=True)
class BandwidthStatistics:
    """A bandwidth. Sizes are in bytes; ``window`` is the number of messages."""

    bytes_per_s: float
    mean: float
    smallest: int
    largest: int
    window: int


@dataclass(frozen=True, slots=True)
class DelayStatistics:
    """Message delays in seconds; ``window`` is the number of messages."""

    average_s: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


class DelayWindow:
    """The delays of the last ``size`` messages."""

    def __init__(self, size: int) -> None:
        self._delays_s: deque[float] = deque(maxlen=size)

    def add(self, delay_s: float) -> None:
        """Add the delay of a message."""
        self._delays_s.append(delay_s)

    def statistics(self) -> DelayStatistics | None:
        """Return the delays, None before the first message."""
        if not self._delays_s:
            return None
        return DelayStatistics(
            average_s=statistics.fmean(self._delays_s),
            shortest_s=min(self._delays_s),
            longest_s=max(self._delays_s),
            deviation_s=statistics.pstdev(self._delays_s),
            window=len(self._delays_s),
        )


class BandwidthWindow:
    """The times and sizes of the last ``size`` messages."""

    def __init__(self, size: int) -> None:
        self._messages: deque[tuple[float, int]] = deque(maxlen=size)

    def add(self, at_s: float, size_bytes: int) -> None:
        """Add the arrival time of a message and its size."""
        self._messages.append((at_s, size_bytes))

    def statistics(self, now_s: float) -> BandwidthStatistics | None:
        """Return the bandwidth from the first message up to now, None before the second one.

        The first message only starts the time: its bytes belong to the time before.
        """
        sizes = [size for _, size in self._messages]
        if len(sizes) < 2 or now_s <= self._messages[0][0]:
            return None
        return BandwidthStatistics(
            bytes_per_s=sum(sizes[1:]) / (now_s - self._messages[0][0]),
            mean=statistics.fmean(sizes),
            smallest=min(sizes),
            largest=max(sizes),
            window=len(sizes),
        )


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
