"""The composer's own scheduler: one thread at a time, no wait set, constant cost per event.

rcl signals what is ready (``readiness``). The scheduler serves the ready groups round robin, one
item each, and a due timer never waits for more than one callback.

The thread of a callback may lose its turn (``turns``). It must not touch the loop after that, so
each function that calls callbacks returns as soon as ``_turn`` is another one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from math import inf

from composer.model import ExecutorKind
from composer.runtime.clock import Clock
from composer.runtime.executors.base_loop import BUSY_S, YIELD_S, ScheduledCall, TimerQueue
from composer.runtime.executors.poller import poller_for
from composer.runtime.executors.readiness import EntitySource, SourceGroup
from composer.runtime.executors.tasks import Report, name_of
from composer.runtime.executors.turns import Turn, TurnTaking

#: How long calls, then items of entities, are served before the next poll.
_ROUND_S = 5e-4
_MAX_FINAL_ROUNDS = 64  # of calls that other calls cause at shutdown


class Scheduler(TurnTaking):
    """Runs calls, timers, tasks and groups of sources. It runs once: start, then stop.

    A loop must have fewer than 30 attributes. Otherwise CPython gives each instance a dictionary of
    its own, and each call gets slower.
    """

    def __init__(
        self, name: str, on_exception: Report, kind: ExecutorKind, threads: int, clock: Clock
    ) -> None:
        super().__init__(name, on_exception, kind, threads, clock)
        self._poller = poller_for(clock)
        self._timers = TimerQueue[ScheduledCall](clock.monotonic, has_ticks=clock.has_ticks)
        self._calls: deque[Callable[[], object]] = deque()
        self._ready: deque[SourceGroup] = deque()  # with something to take
        self._groups: dict[int, SourceGroup] = {}  # by the file descriptor of their signal
        self._timer: ScheduledCall | None = None  # whose callback is being called
        self._sleeping = False
        self._yield_at_s = inf  # not known yet

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""
        self._calls.append(callback)
        if self._sleeping:
            self._poller.wake()

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

    # --- the thread that has the turn

    def _wake(self) -> None:
        self._poller.wake()

    def _leave_call(self) -> None:
        """Serve the timer or the group again whose callback is being called."""
        self._end_timer()
        group = self._running
        if isinstance(group, SourceGroup):
            group.due = max(0, group.due - 1)  # the item that was taken
            if group.due:
                self._ready.append(group)

    def _recover(self) -> None:
        self._ready.clear()  # one group may have been in neither list
        self._ready.extend(group for group in list(self._groups.values()) if group.due)

    def _end_timer(self) -> None:
        """Schedule the next call of the timer whose callback is being called, if any."""
        timer, self._timer = self._timer, None
        if timer is not None:
            self._timers.reschedule(timer)

    def _run_turn(self, turn: Turn) -> None:  # noqa: C901  a function for each part is slower
        """Serve calls, timers and groups until another thread has the turn or the loop stops."""
        timers, calls, poller = self._timers, self._calls, self._poller
        monotonic = self.clock.monotonic
        groups, ready = self._groups, self._ready
        while self._turn is turn and not self._stopping:
            now_s = monotonic()
            if now_s >= timers.next_s:
                self._run_timers(turn, now_s)
            if calls and self._turn is turn:
                self._run_calls(turn)
            if self._turn is not turn:
                return
            if calls or ready:
                self._yield_at_s = self._yield_if_due(now_s)
                signaled = poller.poll()
            else:
                self._yield_at_s = inf
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

    def _run_timers(self, turn: Turn, now_s: float) -> None:
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

    def _run_calls(self, turn: Turn) -> None:
        calls, timers, monotonic = self._calls, self._timers, self.clock.monotonic
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

    def _serve_round(self, turn: Turn) -> None:  # noqa: C901  a function for each part is slower
        # Inlined from here to the handler: after a sleep, each further function is a cache miss.
        ready, timers, monotonic = self._ready, self._timers, self.clock.monotonic
        until_s = monotonic() + _ROUND_S
        while True:
            self._running = group = ready.popleft()
            taken_count = 0
            for source in group.sources:
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

    def _yield_if_due(self, now_s: float) -> float:
        """Sleep briefly if it is time for it; return when to do so next.

        Infinity starts the time of :data:`BUSY_S`.
        """
        if now_s > self._yield_at_s:
            self.clock.sleep(YIELD_S)
        elif self._yield_at_s != inf:
            return self._yield_at_s
        return now_s + BUSY_S
