"""The composer's own scheduler: one thread, no wait set, a cost that does not grow with entities.

rcl announces what is ready (``readiness``); the scheduler goes round what was
announced, one item each, and never keeps a due timer waiting for more than one callback.
"""

from __future__ import annotations

import threading
import traceback
from collections import deque
from collections.abc import Callable, Coroutine
from functools import partial
from math import inf
from time import monotonic, sleep
from typing import Any, TypeVar

from composer.runtime.executors.cross_thread_call import Handover
from composer.runtime.executors.entity_sources import Source
from composer.runtime.executors.loop import ExceptionHandler
from composer.runtime.executors.poller import Poller, wake_in_time
from composer.runtime.executors.source_group import Slot
from composer.runtime.executors.stacks import where
from composer.runtime.executors.tasks import Future, Task, name_of
from composer.runtime.executors.timer_queue import ScheduledCall, Timetable

T = TypeVar("T")

#: So long calls, then items of entities, go on before readiness is looked at again.
_ROUND_S = 5e-4
_LAST_ROUNDS = 64  # of calls that others bring about at the very end
_PAUSE_AFTER_FAULT_S = 0.01
#: So long the loop may be busy before it sleeps for a moment. Each look at what is ready lets go of
#: the interpreter's lock and has it back before a thread that waits for it is awake, who takes that
#: for a change of hands and asks for none: for seconds he gets no turn.
BUSY_S = 0.005
MOMENT_S = 5e-5  # enough to wake up


class Scheduler:
    """Runs calls, timers, tasks and whatever has a slot. It runs once: start, then stop."""

    def __init__(self, name: str, on_exception: ExceptionHandler) -> None:
        self._name = name
        self._on_exception = on_exception
        self._poller = Poller()
        self._timers = Timetable()
        self._calls: deque[Callable[[], object]] = deque()
        self._ready: deque[Slot] = deque()  # with something to take
        self._slots: dict[int, Slot] = {}  # by the file descriptor of their signal
        self._tasks: set[Task[Any]] = set()
        self._running: object = None  # a source or a callback, while it is called
        self._sleeping = False
        self._stopping = False
        self._stopped = False
        self._thread = threading.Thread(target=self._spin, name=f"executor {name}", daemon=True)

    @property
    def name(self) -> str:
        """The name of the executor in YAML."""
        return self._name

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""
        self._calls.append(callback)
        if self._sleeping:
            self._poller.wake()

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> ScheduledCall:
        """Call ``callback`` once, ``delay_s`` seconds from now."""
        # Never before now: what is due then is called in one go, whatever else there is to do.
        return self._schedule(ScheduledCall(monotonic() + max(delay_s, 0.0), None, callback))

    def call_every(self, period_s: float, callback: Callable[[], object]) -> ScheduledCall:
        """Call ``callback`` each ``period_s`` seconds; a late call does not shift the next.

        Raises ValueError for a period that is not positive.
        """
        return self._schedule(ScheduledCall(monotonic() + period_s, period_s, callback))

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; the future is its outcome. Cancelling the future closes it."""
        task = Task(coroutine, self.call_soon, self._report, self._tasks.discard)
        self._tasks.add(task)
        future = task.start()
        if self._stopped:
            task.abandon()
        return future

    def run(self, function: Callable[[], T], timeout_s: float | None = None) -> T:
        """Call ``function`` on the loop and wait for it (at once when already there).

        Raises what ``function`` raises, and TimeoutError when it takes longer; it is not begun
        after that.
        """
        if threading.current_thread() is self._thread:
            return function()
        handover = Handover(function)
        self.call_soon(handover.call)
        if self._stopped and handover.call_off():
            raise RuntimeError(f"executor '{self._name}' has stopped")
        return handover.wait(timeout_s, self.where)

    def start(self) -> None:
        """Begin to call, on a thread of the loop's own."""
        self._thread.start()

    def thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""
        return (self._thread.native_id or 0,)

    def stop(self, timeout_s: float) -> bool:
        """End the thread; false when a callback did not return in time.

        Tasks are cancelled and get a moment to clean up. Called on the loop itself, this asks for
        the end and answers false.
        """
        self._stopping = True
        if threading.current_thread() is self._thread:
            return False
        if self._thread.ident is None:  # never started
            self._wind_up()
            return True
        self._poller.wake()
        self._thread.join(timeout_s)
        if not self._thread.is_alive():
            return True
        for task in tuple(self._tasks):
            task.abandon()
        return False

    def where(self) -> str:
        """Return the Python stack of the callback that runs now; empty when none does."""
        return where(self.threads())

    def threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
        ident = self._thread.ident
        return () if ident is None or self._running is None else (ident,)

    # --- for those who serve entities

    def open_slot(self, *sources: Source) -> Slot:
        """Serve ``sources``, announced by one signal. Raises InvalidHandle, RuntimeError."""
        slot = Slot()
        self._slots[slot.signal.fd] = slot
        self._poller.watch(slot.signal.fd)
        try:
            for source in sources:
                slot.add(source)
        except BaseException:
            self.close_slot(slot)
            raise
        return slot

    def close_slot(self, slot: Slot) -> None:
        """Serve the slot's sources no more."""
        if self._slots.pop(slot.signal.fd, None) is not None:
            self._poller.forget(slot.signal.fd)
            slot.close()

    # --- the thread

    def _spin(self) -> None:
        wake_in_time()
        while not self._stopping:
            try:
                self._take_turns()
            except BaseException as error:  # between two callbacks: an asynchronous one, or ours
                self._report(f"executor '{self._name}'", error)
                sleep(_PAUSE_AFTER_FAULT_S)  # a lasting fault must not fill the log in a second
                self._ready.clear()  # one may have been on its way
                self._ready.extend(slot for slot in list(self._slots.values()) if slot.due)
        self._wind_up()

    def _take_turns(self) -> None:
        timers, calls, poller = self._timers, self._calls, self._poller
        slots, ready = self._slots, self._ready
        rest_at_s = inf  # not known yet
        while not self._stopping:
            now_s = monotonic()
            if now_s >= timers.next_s:
                self._run_timers(now_s)
            if calls:
                self._run_calls()
            if calls or ready:
                rest_at_s = _rest(rest_at_s, now_s)
                announced = poller.ready()
            else:
                rest_at_s = inf
                self._sleeping = True
                # Calls may have been put there while nobody thought us asleep.
                is_free = not (calls or self._stopping)
                announced = poller.wait(timers.next_due_s()) if is_free else poller.ready()
                self._sleeping = False
            for fd, _ in announced:
                slot = slots.get(fd)
                if slot is None:
                    continue
                try:
                    count = slot.signal.read()
                except BlockingIOError:
                    continue  # it is another slot's by now, and nothing was announced there yet
                if not slot.due:
                    ready.append(slot)
                slot.due += count
            if ready:
                self._serve_round()

    def _run_timers(self, now_s: float) -> None:
        timers = self._timers
        while timers.next_s <= now_s:
            call = timers.take()
            try:
                if not call.cancelled:
                    self._calls.appendleft(call.callback)
                    self._run_calls()  # what it brings about need not wait until it is put back
            finally:
                timers.repeat(call)

    def _run_calls(self) -> None:
        calls, timers = self._calls, self._timers
        until_s = monotonic() + _ROUND_S
        while True:  # those that calls bring about included
            self._running = callback = calls.popleft()
            try:
                callback()
            except BaseException as error:
                self._report(name_of(callback), error)
            if not calls or (now_s := monotonic()) >= timers.next_s or now_s >= until_s:
                break
        self._running = None

    def _serve_round(self) -> None:
        # Few functions from here to the handler: after a sleep each is fetched from far away.
        ready, timers = self._ready, self._timers
        until_s = monotonic() + _ROUND_S
        while True:
            slot = ready.popleft()
            brought = 0
            for source in slot.sources:
                self._running = source
                try:
                    taken = source.take()
                except BaseException as error:
                    if source in slot.sources:  # not removed meanwhile
                        self._report(source.name, error)
                        brought += 1
                    continue
                if taken is None:
                    continue
                brought += 1
                try:
                    source.call(taken)
                except BaseException as error:
                    self._report(source.name, error)
            self._running = None
            if brought == slot.due:  # as most often
                slot.due = 0
            else:
                slot.note_round(brought)
                if slot.due:
                    ready.append(slot)
            if not ready or (now_s := monotonic()) >= timers.next_s or now_s >= until_s:
                break

    def _call(self, callback: Callable[[], object]) -> None:
        self._running = callback
        try:
            callback()
        except BaseException as error:
            self._report(name_of(callback), error)
        self._running = None

    def _report(self, what: str, error: BaseException) -> None:
        try:
            self._on_exception(what, error)
        except BaseException:
            traceback.print_exc()  # the last resort: the handler itself failed

    def _schedule(self, call: ScheduledCall) -> ScheduledCall:
        if threading.current_thread() is self._thread:
            self._timers.add(call)
        else:
            self.call_soon(partial(self._timers.add, call))
        return call

    def _wind_up(self) -> None:
        for task in list(self._tasks):
            task.future.cancel()
        self._stopped = True
        for _ in range(_LAST_ROUNDS):
            for _ in range(len(self._calls)):
                self._call(self._calls.popleft())
        for task in list(self._tasks):
            task.close()
        for slot in list(self._slots.values()):
            self.close_slot(slot)
        self._ready.clear()


def _rest(rest_at_s: float, now_s: float) -> float:
    """Sleep for a moment if it is time to; return when it will be, which infinity leaves open."""
    if now_s > rest_at_s:
        sleep(MOMENT_S)
    elif rest_at_s != inf:
        return rest_at_s
    return now_s + BUSY_S
