"""The clock of a system, and the clock of the computer.

The host owns the clock of its system and passes it to the loops, the main queue and the status;
everything else asks the one of its loop or queue. Only this package imports :mod:`time`.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from queue import SimpleQueue
from typing import Final, TypeVar

T = TypeVar("T")


class Clock(ABC):
    """The time of a system, and waits for it. Any thread may call the methods."""

    #: Whether it jumps, instead of waiting, when nothing is left to do.
    is_virtual = False
    #: Whether its system has no contact to other processes.
    is_isolated = False
    #: Whether calls that are due in the same nanosecond are due at the same time: the messages in a
    #: bag have whole nanoseconds, so that a replay repeats their order.
    has_ticks = False

    @abstractmethod
    def monotonic(self) -> float:
        """Return a time in seconds that nothing adjusts; only differences have a meaning."""

    @abstractmethod
    def time_ns(self) -> int:
        """Return the nanoseconds since 1970: the time of stamps."""

    @abstractmethod
    def sleep(self, delay_s: float, /) -> None:
        """Block the calling thread for ``delay_s`` seconds."""

    @abstractmethod
    def wait(self, event: threading.Event, timeout_s: float | None = None) -> bool:
        """Block until ``event`` is set; return false if that takes longer than ``timeout_s``."""

    @abstractmethod
    def get(self, queue: SimpleQueue[T], /) -> T:
        """Wait for an item of a queue, and remove and return it."""

    @abstractmethod
    def start(self, thread: threading.Thread) -> None:
        """Start a thread of the system."""

    @abstractmethod
    def join(self, thread: threading.Thread, timeout_s: float | None = None) -> None:
        """Wait for the end of a thread, at most ``timeout_s`` seconds."""

    def time(self) -> float:
        """Return the seconds since 1970."""
        return self.time_ns() / 1e9


class RealClock(Clock):
    """The time of the computer."""

    # The functions themselves: a loop reads the clock several times per message.
    monotonic = staticmethod(time.monotonic)
    time_ns = staticmethod(time.time_ns)
    sleep = staticmethod(time.sleep)

    def wait(self, event: threading.Event, timeout_s: float | None = None) -> bool:
        """Block until ``event`` is set; return false if that takes longer than ``timeout_s``."""
        return event.wait(timeout_s)

    def get(self, queue: SimpleQueue[T], /) -> T:
        """Wait for an item of a queue, and remove and return it."""
        return queue.get()

    def start(self, thread: threading.Thread) -> None:
        """Start a thread of the system."""
        thread.start()

    def join(self, thread: threading.Thread, timeout_s: float | None = None) -> None:
        """Wait for the end of a thread, at most ``timeout_s`` seconds."""
        thread.join(timeout_s)

    def cpu_s(self, thread: int) -> float:
        """Return the CPU time that a thread has used, by its identifier; zero if it has ended."""
        try:
            return time.clock_gettime(time.pthread_getcpuclockid(thread))
        except OSError:
            return 0.0

    def since_boot_s(self) -> float:
        """Return the seconds since the computer has started, including suspends."""
        return time.clock_gettime(time.CLOCK_BOOTTIME)


#: For what has the time of the computer even if a system has another one: files, other programs,
#: sockets and the middleware.
COMPUTER: Final = RealClock()
