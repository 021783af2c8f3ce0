"""The composer's own scheduler: one thread at a time, no wait set, constant cost per event.

rcl signals what is ready (``readiness``). The scheduler serves the ready groups round robin, one
item each, and a due timer never waits for more than one callback.

If a callback of a class blocks, another thread serves the loop meanwhile: the thread of the
callback loses its *turn*. It must not touch the loop after that, so each function that calls
callbacks returns as soon as ``_turn`` is another one.
"""

from __future__ import annotations

import os
import queue
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from math import inf
from threading import get_ident
from time import monotonic, sleep

from composer.runtime.executors.base_loop import (
    BUSY_S,
    PAUSE_AFTER_FAULT_S,
    YIELD_S,
    BaseLoop,
)
from composer.runtime.executors.entities.source_group import EntitySource, SourceGroup
from composer.runtime.executors.loop import Awaited, ExceptionHandler
from composer.runtime.executors.poller import Poller, use_precise_wakeups
from composer.runtime.executors.tasks import name_of
from composer.runtime.executors.timer_queue import ScheduledCall, TimerQueue

#: How long calls, then items of entities, are served before the next poll.
_ROUND_S = 5e-4
#: A call that is expected to block, and takes less, is not expected to next time.
_BLOCKS_S = 0.005
_MAX_FINAL_ROUNDS = 64  # of calls that other calls cause at shutdown


class _Turn:
    """The time in which one thread serves the loop.

    ``thread`` is its identifier. ``call`` is a call of code that may block, or None: an item that
    is removed either by the thread, at the end of the call, or by the one that takes the turn away.
    """

    __slots__ = ("call", "thread")

    def __init__(self, thread: int = 0, call: list[bool] | None = None) -> None:
        self.thread = thread
        self.call = call


class Scheduler(BaseLoop):
    """Runs calls, timers, tasks and groups of sources. It runs once: start, then stop."""

    def __init__(self, name: str, on_exception: ExceptionHandler) -> None:
        super().__init__(name, on_exception)
        self._poller = Poller()
        self._timers = TimerQueue()
        self._calls: deque[Callable[[], object]] = deque()
        self._ready: deque[SourceGroup] = deque()  # with something to take
        self._groups: dict[int, SourceGroup] = {}  # by the file descriptor of their signal
        self._running: object = None  # the source or callback that is being called
        self._timer: ScheduledCall | None = None  # whose callback is being called
        self._sleeping = False
        self._turn = _Turn()
        #: The identifiers of threads in a callback that have lost their turn.
        self._blocked: set[int] = set()
        self._checked: list[bool] | None = None  # the call that had the turn at the last check
        self._handing_over = threading.Lock()
        self._turns: queue.SimpleQueue[_Turn | None] = queue.SimpleQueue()  # for idle threads
        self._idle: list[threading.Thread] = []
        self._threads: list[threading.Thread] = []
        self._add_thread(self._turn)

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""
        self._calls.append(callback)
        if self._sleeping:
            self._poller.wake()

    def start(self) -> None:
        """Start the thread of the loop."""
        self._threads[0].start()

    def native_thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""
        return tuple(thread.native_id or 0 for thread in self._threads)

    def stop(self, timeout_s: float) -> bool:
        """Stop the threads; return false if a callback did not return in time.

        Tasks are canceled and get a moment to clean up. On the loop itself, this requests the stop
        and returns false.
        """
        until_s = monotonic() + timeout_s
        self._stopping = True
        self._end_waits()
        if self.is_current():
            return False
        if self._threads[0].ident is None:  # never started
            self._shut_down()
            return True
        self._poller.wake()
        for thread in tuple(self._threads):
            thread.join(max(0.0, until_s - monotonic()))
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

    # --- callbacks that block

    def begin_blocking(self, *, expected: bool) -> list[bool] | float | None:
        """Begin a call of code that may block; return what :meth:`end_blocking` needs.

        If it is ``expected`` to block, another thread serves the loop at once.
        """
        turn = self._turn
        if turn.call is not None or turn.thread != get_ident():
            return None
        if expected:
            with self._handing_over:
                self._hand_over()
            return monotonic()
        turn.call = call = [True]
        return call

    def end_blocking(self, began: list[bool] | float | None) -> bool:
        """End a call of code that may block; return whether it has blocked."""
        if began is None:
            return False
        if isinstance(began, float):
            return monotonic() - began > _BLOCKS_S
        try:
            began.pop()
        except IndexError:
            with self._handing_over:
                return True  # once another thread has the turn
        self._turn.call = None
        return False

    def hand_over_blocked(self) -> None:
        """Take the turn away from a call that had it at the last call of this method too."""
        call = self._turn.call
        if call and call is self._checked:
            with self._handing_over, suppress(IndexError):  # it has just ended
                call.pop()
                self._hand_over()
        self._checked = call

    def wait_for(self, future: Awaited, timeout_s: float | None = None) -> bool:
        """Block until ``future`` is done; return false if that takes longer, or the loop stops.

        In a callback, another thread serves the loop meanwhile. The callback continues with its
        turn, so that it overlaps with no other callback of the loop.
        """
        with self._handing_over:
            had_turn = self._has_turn() and not future.done()
            call = self._turn.call
            if had_turn:
                if call is not None:
                    call.clear()
                self._hand_over()
        try:
            return super().wait_for(future, timeout_s)
        finally:
            if had_turn:
                self._resume(call)

    def _has_turn(self) -> bool:
        return self._turn.thread == get_ident()

    def _hand_over(self) -> None:
        """Let another thread serve the loop from now on; its thread is in a callback."""
        running = self._running
        self._blocked.add(self._turn.thread)
        self._running = None
        self._end_timer()
        for group in list(self._groups.values()):
            if running in group.sources:
                group.due = max(0, group.due - 1)  # the item that was taken
                if group.due:
                    self._ready.append(group)
        self._turn = turn = _Turn()
        if self._idle:
            self._idle.pop()
            self._turns.put(turn)
        else:
            self._add_thread(turn).start()

    def _end_timer(self) -> None:
        """Schedule the next call of the timer whose callback is being called, if any."""
        timer, self._timer = self._timer, None
        if timer is not None:
            self._timers.reschedule(timer)

    def _resume(self, call: list[bool] | None) -> None:
        """Get the turn back from the thread that has it now, unless the loop stops."""
        has_turn = threading.Event()
        ident = get_ident()

        def resume() -> None:
            self._end_timer()
            self._blocked.discard(ident)
            self._running = resume  # not what it was: that has been accounted for
            if call is not None:
                call.append(True)
            self._turn = _Turn(ident, call)
            has_turn.set()

        self._waits.add(has_turn)
        self.call_soon(resume)
        if not self._stopping:
            has_turn.wait()
        self._waits.discard(has_turn)

    def _add_thread(self, turn: _Turn) -> threading.Thread:
        number = f" {len(self._threads) + 1}" if self._threads else ""
        thread = threading.Thread(
            target=self._spin, args=(turn,), name=f"executor {self._name}{number}", daemon=True
        )
        self._threads.append(thread)
        return thread

    # --- groups of sources

    def add_group(self, *sources: EntitySource) -> SourceGroup:
        """Serve ``sources`` as one group. Raises InvalidHandle and RuntimeError."""
        group = SourceGroup()
        self._groups[group.signal.fd] = group
        self._poller.register(group.signal.fd)
        try:
            for source in sources:
                group.add(source)
        except BaseException:
            self.remove_group(group)
            raise
        return group

    def remove_group(self, group: SourceGroup) -> None:
        """Stop serving the group's sources."""
        if self._groups.pop(group.signal.fd, None) is not None:
            self._poller.unregister(group.signal.fd)
            group.close()

    # --- the thread

    def _spin(self, turn: _Turn | None) -> None:
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
                    sleep(PAUSE_AFTER_FAULT_S)
                    if self._turn is turn:  # one group may have been in neither list
                        self._ready.clear()
                        self._ready.extend(
                            group for group in list(self._groups.values()) if group.due
                        )
            if self._turn is turn:
                self._shut_down()
                return
            turn = self._next_turn()

    def _next_turn(self) -> _Turn | None:
        """Return the turn of this thread, which has lost its last one; None if the loop stops."""
        self._blocked.discard(get_ident())
        if self._has_turn():
            return self._turn
        self._idle.append(threading.current_thread())
        return self._turns.get()

    def _run_turn(self, turn: _Turn) -> None:  # noqa: C901  a function for each part is slower
        """Serve calls, timers and groups until another thread has the turn or the loop stops."""
        timers, calls, poller = self._timers, self._calls, self._poller
        groups, ready = self._groups, self._ready
        yield_at_s = inf  # not known yet
        while self._turn is turn and not self._stopping:
            now_s = monotonic()
            if now_s >= timers.next_s:
                self._run_timers(turn, now_s)
            if calls and self._turn is turn:
                self._run_calls(turn)
            if self._turn is not turn:
                return
            if calls or ready:
                yield_at_s = _yield_if_due(yield_at_s, now_s)
                signaled = poller.poll()
            else:
                yield_at_s = inf
                self._sleeping = True
                # Check again: a call may have been added before ``_sleeping`` was set.
                is_idle = not (calls or self._stopping)
                signaled = poller.wait(timers.next_due_s()) if is_idle else poller.poll()
                self._sleeping = False
            for fd, _ in signaled:
                group = groups.get(fd)
                if group is None:
                    continue
                try:
                    count = group.signal.read()
                except BlockingIOError:
                    continue  # the descriptor belongs to a new group, without events yet
                if not group.due:
                    ready.append(group)
                group.due += count
            if ready:
                self._serve_round(turn)

    def _run_timers(self, turn: _Turn, now_s: float) -> None:
        timers = self._timers
        while timers.next_s <= now_s:
            self._timer = call = timers.pop()
            try:
                if not call.cancelled:
                    self._calls.appendleft(call.callback)
                    self._run_calls(turn)  # calls that it causes run before it is rescheduled
            finally:
                if self._turn is turn:
                    self._end_timer()
            if self._turn is not turn:
                return

    def _run_calls(self, turn: _Turn) -> None:
        calls, timers = self._calls, self._timers
        until_s = monotonic() + _ROUND_S
        while True:  # including calls that calls add
            self._running = callback = calls.popleft()
            try:
                callback()
            except BaseException as error:
                self.report(name_of(callback), error)
            if self._turn is not turn:
                return
            if not calls or (now_s := monotonic()) >= timers.next_s or now_s >= until_s:
                break
        self._running = None

    def _serve_round(self, turn: _Turn) -> None:  # noqa: C901  a function for each part is slower
        # Inlined from here to the handler: after a sleep, each further function is a cache miss.
        ready, timers = self._ready, self._timers
        until_s = monotonic() + _ROUND_S
        while True:
            group = ready.popleft()
            taken_count = 0
            for source in group.sources:
                self._running = source
                try:
                    taken = source.take()
                except BaseException as error:
                    if source in group.sources:  # not removed meanwhile
                        self.report(source.name, error)
                        taken_count += 1
                    continue
                if taken is None:
                    continue
                taken_count += 1
                try:
                    source.call(taken)
                except BaseException as error:
                    self.report(source.name, error)
                if self._turn is not turn:
                    return
            self._running = None
            if taken_count == group.due:  # the usual case
                group.due = 0
            else:
                group.finish_round(taken_count)
                if group.due:
                    ready.append(group)
            if not ready or (now_s := monotonic()) >= timers.next_s or now_s >= until_s:
                break

    def _schedule(self, call: ScheduledCall) -> ScheduledCall:
        if self._has_turn() and self._turn.call is None:  # or the turn may be taken meanwhile
            self._timers.add(call)
        else:
            self.call_soon(partial(self._timers.add, call))
        return call

    def _shut_down(self) -> None:
        """End the loop on the thread that has the turn; those that wait for a turn end."""
        for _ in range(len(self._threads)):
            self._turns.put(None)
        for task in list(self._tasks):
            task.future.cancel()
        self._stopped = True
        for _ in range(_MAX_FINAL_ROUNDS):
            for _ in range(len(self._calls)):
                self._call(self._calls.popleft())
        for task in list(self._tasks):
            task.close()
        for group in list(self._groups.values()):
            self.remove_group(group)
        self._ready.clear()

    def _call(self, callback: Callable[[], object]) -> None:
        self._running = callback
        try:
            callback()
        except BaseException as error:
            self.report(name_of(callback), error)
        self._running = None


def _place_like(thread: int) -> None:
    """Give the calling thread the CPUs and the priority of another one, by its Linux id."""
    os.sched_setaffinity(0, os.sched_getaffinity(thread))
    os.sched_setscheduler(0, os.sched_getscheduler(thread), os.sched_getparam(thread))


def _yield_if_due(yield_at_s: float, now_s: float) -> float:
    """Sleep briefly if ``yield_at_s`` has passed; return when to do so next.

    Infinity starts the time of :data:`BUSY_S`.
    """
    if now_s > yield_at_s:
        sleep(YIELD_S)
    elif yield_at_s != inf:
        return yield_at_s
    return now_s + BUSY_S
