"""Rates, sizes and ages of what comes over a topic, over a window of the last messages."""

from __future__ import annotations

import statistics
from collections import deque
from dataclasses import dataclass
from itertools import pairwise


@dataclass(frozen=True, slots=True)
class Rate:
    """How often messages came. Periods in seconds; ``window`` is the number of messages."""

    average_hz: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


@dataclass(frozen=True, slots=True)
class Bandwidth:
    """How much came. Sizes in bytes; ``window`` is the number of messages."""

    bytes_per_s: float
    mean: float
    smallest: int
    largest: int
    window: int


@dataclass(frozen=True, slots=True)
class Delay:
    """How old messages were when they came, in seconds; ``window`` is the number of messages."""

    average_s: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


class RateWindow:
    """The times of the last ``size`` messages."""

    def __init__(self, size: int) -> None:
        self._times_s: deque[float] = deque(maxlen=size + 1)

    def add(self, at_s: float) -> None:
        """Note that a message came."""
        self._times_s.append(at_s)

    def rate(self) -> Rate | None:
        """Return the rate; None before the second message."""
        times = list(self._times_s)
        periods = [later - earlier for earlier, later in pairwise(times)]
        total_s = sum(periods)
        if total_s <= 0.0:
            return None
        return Rate(
            average_hz=len(periods) / total_s,
            shortest_s=min(periods),
            longest_s=max(periods),
            deviation_s=statistics.pstdev(periods),
            window=len(periods),
        )


class DelayWindow:
    """The ages of the last ``size`` messages."""

    def __init__(self, size: int) -> None:
        self._ages_s: deque[float] = deque(maxlen=size)

    def add(self, age: float) -> None:
        """Note how old a message was when it came, in seconds."""
        self._ages_s.append(age)

    def delay(self) -> Delay | None:
        """Return the delay; None before the first message."""
        if not self._ages_s:
            return None
        return Delay(
            average_s=statistics.fmean(self._ages_s),
            shortest_s=min(self._ages_s),
            longest_s=max(self._ages_s),
            deviation_s=statistics.pstdev(self._ages_s),
            window=len(self._ages_s),
        )


class BandwidthWindow:
    """The times and sizes of the last ``size`` messages."""

    def __init__(self, size: int) -> None:
        self._seen: deque[tuple[float, int]] = deque(maxlen=size)

    def add(self, at_s: float, size_bytes: int) -> None:
        """Note that a message of so many bytes came."""
        self._seen.append((at_s, size_bytes))

    def bandwidth(self, now_s: float) -> Bandwidth | None:
        """Return the bandwidth up to now; None before the first message."""
        sizes = [size for _, size in self._seen]
        if not sizes or now_s <= self._seen[0][0]:
            return None
        return Bandwidth(
            bytes_per_s=sum(sizes) / (now_s - self._seen[0][0]),
            mean=statistics.fmean(sizes),
            smallest=min(sizes),
            largest=max(sizes),
            window=len(sizes),
        )
