"""The composer's own scheduler: one thread, no wait set, constant cost per event.

rcl signals what is ready (``readiness``). The scheduler serves the ready groups round robin, one
item each, and a due timer never waits for more than one callback.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from functools import partial
from math import inf
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
_MAX_FINAL_ROUNDS = 64  # of calls that other calls cause at shutdown


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
        self._sleeping = False
        self._leaving = False  # the innermost call of _serve_until_left returns
        self._thread = threading.Thread(target=self._spin, name=f"executor {name}", daemon=True)

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""
        self._calls.append(callback)
        if self._sleeping:
            self._poller.wake()

    def start(self) -> None:
        """Start the thread of the loop."""
        self._thread.start()

    def native_thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""
        return (self._thread.native_id or 0,)

    def stop(self, timeout_s: float) -> bool:
        """Stop the thread; return false if a callback did not return in time.

        Tasks are canceled and get a moment to clean up. On the loop itself, this requests the stop
        and returns false.
        """
        self._stopping = True
        self._leaving = True
        if self.is_current():
            return False
        if self._thread.ident is None:  # never started
            self._shut_down()
            return True
        self._poller.wake()
        self._thread.join(timeout_s)
        if not self._thread.is_alive():
            return True
        for task in tuple(self._tasks):
            task.abandon()
        return False

    def wait_for(self, future: Awaited, timeout_s: float | None = None) -> bool:
        """Block until ``future`` is done; return false if that takes longer.

        On the thread of the loop, in a callback, everything else is served meanwhile, except the
        group of the callback itself.
        """
        if not self.is_current():
            return super().wait_for(future, timeout_s)
        end_s = inf if timeout_s is None else monotonic() + timeout_s
        timer = None if timeout_s is None else self.call_later(timeout_s, self._leave)
        future.add_done_callback(self._leave)
        self._timers.next_due_s()  # without the timer that is calling now, if any
        running = self._running
        try:
            while True:
                self._leaving = False  # first: the future may be done before the next check
                if future.done() or self._stopping or monotonic() >= end_s:
                    break
                self._serve_until_left()
        finally:
            self._running = running
            self._leaving = True  # a call further out checks its own future
            if timer is not None:
                timer.cancel()
        return future.done()

    def _leave(self, _: object = None) -> None:
        """Let the innermost call of ``_serve_until_left`` return. From any thread."""
        self._leaving = True
        if self._sleeping:
            self._poller.wake()

    def busy_threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
        ident = self._thread.ident
        return () if ident is None or self._running is None else (ident,)

    def is_current(self) -> bool:
        """Return whether the calling thread belongs to the loop."""
        return threading.current_thread() is self._thread

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

    def _spin(self) -> None:
        use_precise_wakeups()
        while not self._stopping:
            try:
                self._leaving = False
                if not self._stopping:  # a stop sets it before it sets ``_leaving``
                    self._serve_until_left()
            except BaseException as error:  # between callbacks: an asynchronous one, or a bug
                self.report(f"executor '{self._name}'", error)
                sleep(PAUSE_AFTER_FAULT_S)
                self._ready.clear()  # one group may have been in neither list
                self._ready.extend(group for group in list(self._groups.values()) if group.due)
        self._shut_down()

    def _serve_until_left(self) -> None:
        """Serve calls, timers and groups until ``_leaving`` is set."""
        timers, calls, poller = self._timers, self._calls, self._poller
        groups, ready = self._groups, self._ready
        yield_at_s = inf  # not known yet
        while not self._leaving:
            now_s = monotonic()
            if now_s >= timers.next_s:
                self._run_timers(now_s)
            if calls:
                self._run_calls()
            if calls or ready:
                yield_at_s = _yield_if_due(yield_at_s, now_s)
                signaled = poller.poll()
            else:
                yield_at_s = inf
                self._sleeping = True
                # Check again: a call may have been added before ``_sleeping`` was set.
                is_idle = not (calls or self._leaving)
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
                self._serve_round()

    def _run_timers(self, now_s: float) -> None:
        timers = self._timers
        while timers.next_s <= now_s:
            call = timers.pop()
            try:
                if not call.cancelled:
                    self._calls.appendleft(call.callback)
                    self._run_calls()  # calls that it causes run before it is rescheduled
            finally:
                timers.reschedule(call)

    def _run_calls(self) -> None:
        calls, timers = self._calls, self._timers
        until_s = monotonic() + _ROUND_S
        while True:  # including calls that calls add
            self._running = callback = calls.popleft()
            try:
                callback()
            except BaseException as error:
                self.report(name_of(callback), error)
            if not calls or (now_s := monotonic()) >= timers.next_s or now_s >= until_s:
                break
        self._running = None

    def _serve_round(self) -> None:
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
        if self.is_current():
            self._timers.add(call)
        else:
            self.call_soon(partial(self._timers.add, call))
        return call

    def _shut_down(self) -> None:
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


def _yield_if_due(yield_at_s: float, now_s: float) -> float:
    """Sleep briefly if ``yield_at_s`` has passed; return when to do so next.

    Infinity starts the time of :data:`BUSY_S`.
    """
    if now_s > yield_at_s:
        sleep(YIELD_S)
    elif yield_at_s != inf:
        return yield_at_s
    return now_s + BUSY_S
