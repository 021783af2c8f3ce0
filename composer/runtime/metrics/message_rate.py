"""Message rates, from burst to burst, for everything that shows them."""

from __future__ import annotations

from collections import deque

from composer.base.fast_dataclass import dataclass


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
#: A current rate counts the messages of the last seconds.
_WINDOW_S = 3.0
#: Messages have stopped after this many times the length of the window.
_SILENT_PERIODS = 3


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
