"""Rates of messages, and snapshots of the statistics of callbacks and chains with their rates."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from composer.base.fast_dataclass import dataclass
from composer.runtime.metrics.statistics import CallbackStatistics, ChainStatistics
from composer.runtime.protocol.reports import CallbackFigures, ChainFigures

#: Messages that are closer than this count as one burst.
_BURST_S = 0.1
#: A current rate counts the messages of the last seconds.
_WINDOW_S = 3.0
#: Messages have stopped after this many times the length of the window.
_SILENT_PERIODS = 3
_MS = 1e3
#: Reports about changes of state are closer to the last one, too close to measure rates.
_APART_S = 0.5


@dataclass(slots=True)
class _Burst:
    """The messages of up to ``_BURST_S``, and those missed since the burst before."""

    start_s: float
    missed: int
    messages: int = 1
    received: int = 1
    size_bytes: int = 0


class MessageRate:
    """A rate of messages, also if they come in bursts: from burst to burst.

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

    def current_hz(self, now_s: float) -> float | None:
        """Return the rate of the last seconds, 0 once messages have stopped; None if not known."""
        self.forget_before(now_s - _WINDOW_S)
        is_silent = now_s - self.last_s > max(_WINDOW_S, _SILENT_PERIODS * self.span_s)
        return 0.0 if is_silent else self.hertz

    @property
    def mean_bytes(self) -> float | None:
        """The mean size of the messages, None before the first one."""
        received = sum(item.received for item in self._bursts)
        return sum(item.size_bytes for item in self._bursts) / received if received else None


class CountedRate:
    """The rate of messages from a counter, which is read about every second."""

    def __init__(self) -> None:
        self._rate = MessageRate()
        self._count: int | None = None

    def read(self, count: int, at_s: float) -> None:
        """Read the counter; ``at_s`` is the time of the last message, as far as it is known."""
        if self._count is None or count < self._count:  # it counts from zero again
            self._rate = MessageRate()
            self._rate.last_s = at_s
        elif count > self._count:
            self._rate.add(at_s, missed=count - self._count - 1)
            self._rate.forget_before(at_s - _WINDOW_S)
        self._count = count

    def current_hz(self, now_s: float) -> float | None:
        """Return the rate of the last seconds, 0 once messages have stopped; None if not known."""
        return self._rate.current_hz(now_s)


def figures(node: str, statistics: CallbackStatistics) -> CallbackFigures:
    """Return the figures of a callback; ``node`` is the full name of its node."""
    times, lateness = statistics.times, statistics.lateness
    return CallbackFigures(
        node=node,
        kind=statistics.kind,
        name=statistics.name,
        count=times.count,
        total_ms=times.total_s * _MS,
        mean_ms=times.mean_s * _MS,
        p99_ms=times.percentile_s(0.99) * _MS,
        longest_ms=times.longest_s * _MS,
        late_p99_ms=lateness.percentile_s(0.99) * _MS,
        late_longest_ms=lateness.longest_s * _MS,
        overruns=statistics.overruns,
        dropped=statistics.dropped,
        histogram=times.text,
    )


def chain_figures(statistics: ChainStatistics) -> ChainFigures:
    """Return the figures of a chain."""
    times = statistics.times
    return ChainFigures(
        chain=statistics.name,
        latency_ms=statistics.latency_ms,
        count=times.count,
        mean_ms=times.mean_s * _MS,
        p99_ms=times.percentile_s(0.99) * _MS,
        longest_ms=times.longest_s * _MS,
        late=statistics.late,
    )


def merged_chains(
    chains: Iterable[ChainFigures], of_others: Iterable[ChainFigures]
) -> tuple[ChainFigures, ...]:
    """Return chains as other processes know them: the one with all nodes of a chain measures it."""
    merged = {chain.chain: chain for chain in chains}
    for chain in of_others:
        if chain.chain in merged and chain.count > merged[chain.chain].count:
            merged[chain.chain] = chain
    return tuple(merged.values())


@dataclass(frozen=True, slots=True)
class CallbackRates:
    """A callback with its calls per second, and the share of one thread in the last interval.

    The calls are counted from burst to burst, as messages are; until there are two bursts, in the
    last interval. Both are None before the second report.
    """

    figures: CallbackFigures
    calls_hz: float | None = None
    busy: float | None = None


@dataclass(slots=True)
class _Reading:
    """The last rates of a callback, and what they follow from."""

    calls: CountedRate
    rates: CallbackRates


class CallbackMeter:
    """The rates of the callbacks of a process, from its reports."""

    def __init__(self) -> None:
        self._readings: dict[tuple[str, str, str], _Reading] = {}
        self._at_s: float | None = None  # of the last report that was read
        #: When the last report was read that has rates: not the first one.
        self.rated_s: float | None = None

    def read(self, callbacks: Iterable[CallbackFigures], at_s: float) -> list[CallbackRates]:
        """Return the rates of callbacks that were reported ``at_s``."""
        elapsed_s = -1.0 if self._at_s is None else at_s - self._at_s
        if not 0.0 <= elapsed_s < _APART_S:
            before = self._readings if elapsed_s > 0.0 else {}  # simulated time may begin again
            self._readings = {
                key: _next(before.get(key), item, at_s, elapsed_s)
                for item in callbacks
                for key in ((item.node, item.kind, item.name),)
            }
            self._at_s = at_s
            self.rated_s = at_s if elapsed_s > 0.0 else None
        return [reading.rates for reading in self._readings.values()]


def _next(before: _Reading | None, now: CallbackFigures, at_s: float, elapsed_s: float) -> _Reading:
    if before is None or now.count < before.rates.figures.count:
        calls = CountedRate()  # the first report, or a node that was created again
        calls.read(now.count, at_s)
        return _Reading(calls, CallbackRates(now))
    last = before.rates.figures
    before.calls.read(now.count, at_s)
    calls_hz = before.calls.current_hz(at_s)
    if calls_hz is None:
        calls_hz = (now.count - last.count) / elapsed_s
    busy = max(0.0, now.total_ms - last.total_ms) / (_MS * elapsed_s)
    return _Reading(before.calls, CallbackRates(now, calls_hz, busy))
