"""The clock: whatever reads or waits for time in a running system asks it.

The host owns the clock of its system and passes it to the loops, the main queue and the status;
everything else asks the one of its loop or queue. Only this module imports :mod:`time`.

Virtual time is a clock that jumps to the next point in time whenever nothing is left to do. The
threads of a system take turns: one runs, the others wait in a method of the clock. A thread that
begins to wait passes the turn on: to the one that has waited longest of those whose wait has ended,
or else, after a jump of the time, to the one whose wait ends first. So there is one order of
everything that happens, whatever the computer does meanwhile, and no thread waits for real time.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from math import inf
from queue import SimpleQueue
from threading import current_thread, get_ident, main_thread
from typing import Final, TypeVar

T = TypeVar("T")

#: Virtual time begins in September 2001: not at zero, which means in ROS that no time is known.
START_NS: Final = 10**18
_NANOSECONDS = 1_000_000_000
#: A standstill is noticed each time that the clock was read so often at one point in time. A prime,
#: so that it is noticed at each place of a loop.
STANDSTILL_READS: Final = 2_999
#: How often a system that has nothing to wait for looks for signals and other threads.
_POLL_S = 0.001
#: How often the main thread looks for signals while it waits for its turn, in real time.
_SIGNALS_S = 0.1
#: How long a thread that is interrupted waits for its turn, in real time.
_INTERRUPTED_WITHIN_S = 1.0


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


class _Waiting:
    """A thread that waits for ``is_over()`` or ``until_s``, and then for its turn."""

    __slots__ = ("is_over", "turn", "until_s")

    def __init__(self, is_over: Callable[[], bool], until_s: float) -> None:
        self.is_over = is_over
        self.until_s = until_s
        self.turn = threading.Lock()
        self.turn.acquire()


class VirtualClock(Clock):
    """The time of a system that runs in virtual time.

    The thread that creates it has the first turn. Other threads of the system begin by
    :meth:`start`. Threads that did not are not of the system: they wait in real time.
    """

    is_virtual = True
    has_ticks = True

    def __init__(
        self, speed: float = inf, *, is_isolated: bool = True, start_ns: int = START_NS
    ) -> None:
        """``speed`` limits how many times as fast as real time the time advances.

        Unless it ``is_isolated``, the system takes part in the ROS graph, and publishes its time.
        ``start_ns`` is the time of the start, in nanoseconds since 1970.
        """
        self.is_isolated = is_isolated
        self._start_ns = start_ns
        self._speed = speed
        self._pace_from_s: float | None = None  # the time of the computer when the time was 0
        self._now_s = 0.0
        self._waiting: list[_Waiting] = []  # since when they wait, the longest first
        self._members = {get_ident()}
        self._alive: set[threading.Thread] = set()
        self._followers: list[Callable[[int], None]] = []
        #: The identifier of the thread that has the turn.
        self.running_thread = get_ident()
        #: How often a thread has begun its turn.
        self.turns = 0
        self._reads = 0  # since the last jump
        self._creeps_s = 0.0  # at each read
        #: Called on the thread that reads the clock, each :data:`STANDSTILL_READS` without a jump.
        self.on_standstill: Callable[[], None] = lambda: None

    def monotonic(self) -> float:
        """Return the seconds since the start."""
        self._reads += 1
        if not self._reads % STANDSTILL_READS:
            self.on_standstill()
        self._now_s += self._creeps_s
        return self._now_s

    def creep(self) -> None:
        """Let each read of the clock take a microsecond: the system does not wait any more.

        Then its threads get their turns although one has work without end.
        """
        self._creeps_s = 1e-6

    def time_ns(self) -> int:
        """Return the nanoseconds since 1970, as if the system had started at ``start_ns``."""
        return self._start_ns + round(self.monotonic() * _NANOSECONDS)

    def sleep(self, delay_s: float, /) -> None:
        """Block the calling thread for ``delay_s`` seconds of virtual time."""
        self.wait_until(lambda: False, self._now_s + delay_s)

    def wait(self, event: threading.Event, timeout_s: float | None = None) -> bool:
        """Block until ``event`` is set; return false if that takes longer than ``timeout_s``."""
        return self.wait_until(event.is_set, inf if timeout_s is None else self._now_s + timeout_s)

    def get(self, queue: SimpleQueue[T], /) -> T:
        """Wait for an item of a queue, and remove and return it."""
        self.wait_until(lambda: not queue.empty())
        return queue.get()

    def start(self, thread: threading.Thread) -> None:
        """Start a thread of the system; it runs when it gets the turn."""
        first = _Waiting(lambda: True, self._now_s)
        run = thread.run

        def run_in_turn() -> None:
            self._members.add(get_ident())
            first.turn.acquire()
            self.running_thread = get_ident()
            try:
                run()
            finally:
                self._members.discard(get_ident())
                self._alive.discard(thread)
                self._next().turn.release()

        thread.run = run_in_turn  # type: ignore[method-assign]
        self._alive.add(thread)
        self._waiting.append(first)
        thread.start()

    def join(self, thread: threading.Thread, timeout_s: float | None = None) -> None:
        """Wait for the end of a thread, at most ``timeout_s`` seconds."""
        until_s = inf if timeout_s is None else self._now_s + timeout_s
        if self.wait_until(lambda: thread not in self._alive, until_s):
            thread.join()

    def wait_until(self, is_over: Callable[[], bool], until_s: float = inf) -> bool:
        """Block until ``is_over()``, at most until ``until_s`` (monotonic); return its value."""
        self.monotonic()  # threads may wake each other without end
        if get_ident() in self._members:
            self._wait_for_turn(_Waiting(is_over, until_s))
        else:
            while not is_over() and self._now_s < until_s:
                COMPUTER.sleep(_POLL_S)
        return is_over()

    def pass_turn_on(self) -> None:
        """Pass the turn on from a thread that does not return, and is not of the system any more.

        Any thread may call it, once the system stops.
        """
        self._members.discard(self.running_thread)
        self._next().turn.release()

    def follow(self, follower: Callable[[int], None]) -> None:
        """Call ``follower(nanoseconds since 1970)`` now and after each jump."""
        self._followers.append(follower)
        follower(self.time_ns())

    def unfollow(self, follower: Callable[[int], None]) -> None:
        """Stop calling a follower."""
        self._followers.remove(follower)

    def _wait_for_turn(self, waiting: _Waiting) -> None:
        self._waiting.append(waiting)
        self._next().turn.release()
        # A signal that arrives just before the wait for a lock does not end it, and Python calls
        # handlers on the main thread only.
        limit_s = _SIGNALS_S if current_thread() is main_thread() else -1
        try:
            while not waiting.turn.acquire(timeout=limit_s):
                pass
        except BaseException:
            # A signal handler has raised it, such as KeyboardInterrupt. Another thread has the turn
            # and passes it on, unless a callback does not return.
            waiting.is_over = lambda: True
            if not waiting.turn.acquire(timeout=_INTERRUPTED_WITHIN_S):
                self._waiting.remove(waiting)
            raise
        self.running_thread = get_ident()

    def _next(self) -> _Waiting:
        """Return the thread that has the next turn; it does not wait any more."""
        while True:
            for waiting in self._waiting:
                if waiting.is_over():
                    break
            else:
                waiting = min(self._waiting, key=lambda waiting: waiting.until_s)
                left_s = self._real_s_until(waiting.until_s)
                if left_s > 0.0:
                    COMPUTER.sleep(min(left_s, _POLL_S))
                    continue
                self._jump(waiting.until_s)
            self._waiting.remove(waiting)
            self.turns += 1
            return waiting

    def _real_s_until(self, until_s: float) -> float:
        """Return the seconds of real time after which the time may jump to ``until_s``."""
        if until_s == inf:
            return inf
        if self._speed == inf:
            return 0.0
        real_s = COMPUTER.monotonic()
        if self._pace_from_s is None:
            self._pace_from_s = real_s - self._now_s / self._speed
        return self._pace_from_s + until_s / self._speed - real_s

    def _jump(self, to_s: float) -> None:
        if to_s > self._now_s:
            self._now_s = to_s
            self._reads = 0
            for follower in self._followers:
                follower(self.time_ns())


class Wakeup:
    """Wakes the current wait of a thread, or the next one, in virtual time."""

    #: There is no file descriptor: Python calls signal handlers while a thread waits for its turn.
    fd = -1

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self._is_woken = False

    def wake(self) -> None:
        """End the current or the next wait, from any thread or a signal handler."""
        self._is_woken = True

    def wait(self, until_s: float = inf, is_over: Callable[[], bool] = lambda: False) -> bool:
        """Wait for a wake-up or ``is_over()``; return False if ``until_s`` comes first."""
        is_woken = self._clock.wait_until(lambda: self._is_woken or is_over(), until_s)
        self._is_woken = False
        return is_woken
