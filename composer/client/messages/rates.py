"""Rates, sizes and delays of the messages of a topic, over a window of the last ones."""

from __future__ import annotations

import statistics
from collections import deque
from itertools import pairwise

from composer.base.fast_dataclass import dataclass


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


@dataclass(slots=True)
class _Burst:
    """The messages of up to ``_BURST_S``, and those missed since the burst before."""

    start_s: float
    missed: int
    messages: int = 1
    received: int = 1
    size_bytes: int = 0


#: Messages that are closer than this count as one burst.
_BURST_S = 0.1


class TopicRate:
    """The rate of a topic, also if its messages come in bursts: from burst to burst.

    Two messages at once, each second, are 2 Hz. Times are those at which messages were published.
    """

    def __init__(self) -> None:
        self._bursts: deque[_Burst] = deque()
        self.last_s = 0.0

    def add(self, at_s: float, size_bytes: int = 0, missed: int = 0) -> None:
        """Add a message; ``missed`` is how many were published since the last one received."""
        last = self._bursts[-1] if self._bursts else None
        if last is None or at_s - last.start_s >= _BURST_S:
            last = _Burst(at_s, missed)
            self._bursts.append(last)
        else:
            last.messages += 1 + missed
            last.received += 1
        last.size_bytes += size_bytes
        self.last_s = at_s

    def forget_before(self, time_s: float) -> None:
        """Forget messages from before a time, except for the last two bursts."""
        while len(self._bursts) > 2 and self._bursts[0].start_s < time_s:
            self._bursts.popleft()

    def forget_beyond(self, messages: int) -> None:
        """Forget the first bursts, except those with the last ``messages`` before the last one."""
        kept = sum(item.messages for item in list(self._bursts)[:-1])
        while len(self._bursts) > 2 and kept - self._bursts[0].messages >= messages:
            kept -= self._bursts.popleft().messages

    @property
    def span_s(self) -> float:
        """The time from the first burst to the last one."""
        return self._bursts[-1].start_s - self._bursts[0].start_s if self._bursts else 0.0

    @property
    def hertz(self) -> float | None:
        """The rate, None before the second burst."""
        if len(self._bursts) < 2:
            return None
        bursts = list(self._bursts)
        # The last burst may go on, and what was missed before the first one is older.
        messages = sum(item.messages for item in bursts[:-1])
        return (messages + sum(item.missed for item in bursts[1:])) / self.span_s

    @property
    def mean_bytes(self) -> float | None:
        """The mean size of the messages, None before the first one."""
        received = sum(item.received for item in self._bursts)
        return sum(item.size_bytes for item in self._bursts) / received if received else None


class RateWindow:
    """The arrival times of the last ``size`` messages, and the rate of as many in whole bursts."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._times_s: deque[float] = deque(maxlen=size + 1)
        self._rate = TopicRate()

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
