"""Turns: one thread at a time serves a loop, and another one while a callback runs or blocks.

- ``events``: a callback that waits gives its turn away, and gets it back at the end of the wait.
  From a call of code that may block, :class:`TurnWatch` takes the turn when it lasts; it goes on
  without. So a loop of one node needs no pool of threads to be always served.
- ``multi_threaded``: each callback of a node gives its turn away when it begins, so that as many
  run at the same time as the executor has threads.
- ``single_threaded``: no callback gives its turn away.
"""

from __future__ import annotations

import os
import queue
import threading
from abc import abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from threading import get_ident

from composer.model import ExecutorKind
from composer.runtime.clock import Clock
from composer.runtime.executors.base_loop import PAUSE_AFTER_FAULT_S, BaseLoop
from composer.runtime.executors.poller import use_precise_wakeups
from composer.runtime.executors.tasks import Report

#: A call that is expected to block, and takes less, is not expected to next time.
_BLOCKS_S = 0.005
#: A call blocks if it keeps its loop for one of these periods after it was noticed.
_WATCH_PERIOD_S = 0.02
#: The watch looks less often while it meets no call: each look costs 70 us of CPU.
_LONGEST_WATCH_PERIOD_S = 0.1


class Turn:
    """The time in which one thread serves the loop.

    ``thread`` is its identifier. ``call`` is a call of code that may block, or None: an item that
    is removed either by the thread, at the end of the call, or by the one that takes the turn away.
    """

    __slots__ = ("call", "thread")

    def __init__(self, thread: int = 0, call: list[bool] | None = None) -> None:
        self.thread = thread
        self.call = call


class TurnTaking(BaseLoop):
    """The threads of a loop: one of them has the turn."""

    def __init__(
        self,
        name: str,
        on_exception: Report,
        kind: ExecutorKind,
        threads: int,
        clock: Clock,
    ) -> None:
        super().__init__(name, on_exception, clock)
        self._replaces_blocked = kind is ExecutorKind.EVENTS
        #: With several threads, an item for each callback that may begin.
        self._slots: queue.SimpleQueue[None] | None = None
        if kind is ExecutorKind.MULTI_THREADED:
            self._slots = queue.SimpleQueue()
            self._free_slots(threads)
            self._step_soon = self._step_in_parallel
        self._running: object = None  # the group or callback that is being called
        self._turn = Turn()
        #: The identifiers of threads in a callback that have lost their turn.
        self._blocked: set[int] = set()
        self._checked: list[bool] | None = None  # the call that had the turn at the last check
        self._handing_over = threading.Lock()
        self._turns: queue.SimpleQueue[Turn | None] = queue.SimpleQueue()  # for idle threads
        self._idle: list[None] = []  # an item for each idle thread: any of them takes a turn
        self._threads: list[threading.Thread] = []
        self._add_thread(self._turn)

    @abstractmethod
    def _run_turn(self, turn: Turn) -> None:
        """Serve the loop until another thread has the turn or the loop stops."""

    @abstractmethod
    def _leave_call(self) -> None:
        """Prepare the loop for going on while what is being called has not returned."""

    @abstractmethod
    def _recover(self) -> None:
        """Repair the loop after an exception between callbacks."""

    @abstractmethod
    def _shut_down(self) -> None:
        """End the loop, on the thread that has the turn."""

    @abstractmethod
    def _wake(self) -> None:
        """Let the thread that has the turn notice that the loop stops."""

    def start(self) -> None:
        """Start the thread of the loop."""
        self.clock.start(self._threads[0])

    def native_thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""
        return tuple(thread.native_id or 0 for thread in self._threads)

    def stop(self, timeout_s: float) -> bool:
        """Stop the threads; return false if a callback did not return in time.

        Tasks are canceled and get a moment to clean up. On the loop itself, this requests the stop
        and returns false.
        """
        until_s = self.clock.monotonic() + timeout_s
        self._stopping = True
        self._end_waits()
        if self._threads[0].ident is None:  # never started
            self._shut_down()
            return True
        self._free_slots(1)
        self._wake()
        if self.is_current():
            return False
        for thread in tuple(self._threads):
            self.clock.join(thread, max(0.0, until_s - self.clock.monotonic()))
        if not any(thread.is_alive() for thread in self._threads):
            return True
        for task in tuple(self._tasks):
            task.abandon()
        return False

    def busy_threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
        serving = () if self._running is None else (self._turn.thread,)
        return (*serving, *tuple(self._blocked))

    def is_current(self) -> bool:
        """Return whether the calling thread belongs to the loop."""
        return self._has_turn() or get_ident() in self._blocked

    # --- callbacks that overlap, or block

    @property
    def is_parallel(self) -> bool:
        """Whether callbacks may overlap."""
        return self._slots is not None

    def overlap(self) -> None:
        """Wait until a callback may begin, then let another thread of the loop have the turn.

        Does nothing if the loop has one thread, or this thread does not have the turn.
        """
        if self._slots is not None and self._has_turn() and not self._stopping:
            self._slots.get()
            with self._handing_over:
                self._hand_over()

    def begin_blocking(self, *, expected: bool) -> list[bool] | float | None:
        """Begin a call of code that may block; return what :meth:`end_blocking` needs.

        If it is ``expected`` to block, another thread serves the loop at once.
        """
        turn = self._turn
        if turn.call is not None or turn.thread != get_ident() or not self._replaces_blocked:
            return None
        if expected:
            with self._handing_over:
                self._hand_over()
            return self.clock.monotonic()
        turn.call = call = [True]
        return call

    def end_blocking(self, began: list[bool] | float | None) -> bool:
        """End a call of code that may block; return whether it has blocked."""
        if began is None:
            return False
        if isinstance(began, float):
            return self.clock.monotonic() - began > _BLOCKS_S
        try:
            began.pop()
        except IndexError:
            with self._handing_over:
                return True  # once another thread has the turn
        self._turn.call = None
        return False

    def hand_over_blocked(self) -> bool:
        """Take the turn away from a call that had it at the last call of this method too.

        Returns whether a call has the turn that may block.
        """
        call = self._turn.call
        if call and call is self._checked:
            with self._handing_over, suppress(IndexError):  # it has just ended
                call.pop()
                self._hand_over()
        self._checked = call
        return bool(call)

    def wait(self, event: threading.Event, timeout_s: float | None = None) -> None:
        """Block until ``event`` is set or the time is over. A loop that stops sets the event.

        In a callback, another thread serves the loop meanwhile, if its kind allows it. On a loop
        of kind *events*, the callback continues with its turn, so that it overlaps with no other
        one.
        """
        self.overlap()
        with self._handing_over:
            had_turn = self._replaces_blocked and self._has_turn() and not event.is_set()
            call = self._turn.call
            if had_turn:
                if call is not None:
                    call.clear()
                self._hand_over()
        try:
            super().wait(event, timeout_s)
        finally:
            if had_turn:
                self._resume(call)

    def _has_turn(self) -> bool:
        return self._turn.thread == get_ident()

    def _hand_over(self) -> None:
        """Let another thread serve the loop from now on; its thread is in a callback."""
        self._leave_call()
        self._blocked.add(self._turn.thread)
        self._running = None
        self._turn = turn = Turn()
        if self._idle:
            self._idle.pop()
            self._turns.put(turn)
        else:
            self.clock.start(self._add_thread(turn))

    def _resume(self, call: list[bool] | None) -> None:
        """Get the turn back from the thread that has it now, unless the loop stops."""
        has_turn = threading.Event()
        ident = get_ident()

        def resume() -> None:
            if self._stopping:
                return
            self._leave_call()
            self._blocked.discard(ident)
            self._running = resume  # not what it was: that has been accounted for
            if call is not None:
                call.append(True)
            self._turn = Turn(ident, call)
            has_turn.set()

        self._waits.add(has_turn)
        self.call_soon(resume)
        if not self._stopping:
            self.clock.wait(has_turn)
        self._waits.discard(has_turn)

    def _step_in_parallel(self, step: Callable[[], object]) -> None:
        def overlapping() -> None:
            self.overlap()
            step()

        self.call_soon(overlapping)

    def _free_slots(self, number: int) -> None:
        if self._slots is not None:
            for _ in range(number):
                self._slots.put(None)

    def _add_thread(self, turn: Turn) -> threading.Thread:
        number = f" {len(self._threads) + 1}" if self._threads else ""
        thread = threading.Thread(
            target=self._spin, args=(turn,), name=f"executor {self._name}{number}", daemon=True
        )
        self._threads.append(thread)
        return thread

    # --- the threads

    def _spin(self, turn: Turn | None) -> None:
        use_precise_wakeups()
        first = self._threads[0]
        if threading.current_thread() is not first:
            _place_like(first.native_id or 0)
        while turn is not None:
            turn.thread = get_ident()
            self._running = None
            while self._turn is turn and not self._stopping:
                try:
                    self._run_turn(turn)
                except BaseException as error:  # between callbacks: an asynchronous one, or a bug
                    self.report(f"executor '{self._name}'", error)
                    self.clock.sleep(PAUSE_AFTER_FAULT_S)
                    if self._turn is turn:
                        self._recover()
            if self._turn is turn:
                for _ in self._threads:
                    self._turns.put(None)
                self._shut_down()
                return
            turn = self._next_turn()

    def _next_turn(self) -> Turn | None:
        """Return the turn of this thread, which has lost its last one; None if the loop stops."""
        holds_slot = True
        while True:
            try:
                self._blocked.discard(get_ident())
                if holds_slot:
                    holds_slot = False
                    self._free_slots(1)
                if self._has_turn():
                    return self._turn
                self._idle.append(None)
                return self.clock.get(self._turns)
            except BaseException as error:  # an interrupt of a callback that has just returned
                self.report(f"executor '{self._name}'", error)


def _place_like(thread: int) -> None:
    """Give the calling thread the CPUs and the priority of another one, by its Linux id."""
    os.sched_setaffinity(0, os.sched_getaffinity(thread))
    os.sched_setscheduler(0, os.sched_getscheduler(thread), os.sched_getparam(thread))


class TurnWatch:
    """A thread that takes the turn away from callbacks of classes that block."""

    def __init__(self, loops: Callable[[], Iterable[TurnTaking]]) -> None:
        self._loops = loops
        self._end = threading.Lock()  # released at the end: cheaper to wait for than an event
        self._end.acquire()
        self._thread = threading.Thread(target=self._run, name="turn watch", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread."""
        if self._end.locked():
            self._end.release()

    def _run(self) -> None:
        period_s = _WATCH_PERIOD_S
        while not self._end.acquire(timeout=period_s):
            is_calling = [loop.hand_over_blocked() for loop in tuple(self._loops())]
            longer_s = min(2 * period_s, _LONGEST_WATCH_PERIOD_S)
            period_s = _WATCH_PERIOD_S if any(is_calling) else longer_s
