"""The loop of ``kind: single_threaded`` and ``multi_threaded``, on rclpy's executors."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from time import monotonic, sleep
from typing import Any

from rclpy.node import Node

from composer.runtime.executors.base_loop import PAUSE_AFTER_FAULT_S
from composer.runtime.executors.entities.source_group import EntitySource
from composer.runtime.executors.entity_loop import EntityLoop
from composer.runtime.executors.loop import ExceptionHandler
from composer.runtime.executors.tasks import name_of
from composer.runtime.executors.timer_queue import ScheduledCall
from composer.runtime.executors.wait_set.executors import (
    MultiThreadedWaitSetExecutor,
    SingleThreadedWaitSetExecutor,
    WaitSetExecutor,
)
from composer.runtime.executors.wait_set.timer_thread import TimerThread

_CLEAN_UP_S = 0.2  # for canceled tasks


class WaitSetLoop(EntityLoop):
    """A :class:`~composer.runtime.executors.loop.Loop` on one of rclpy's executors.

    It runs once: start, then stop. Without ``threads`` it uses the single-threaded executor.
    """

    def __init__(self, name: str, on_exception: ExceptionHandler, threads: int | None) -> None:
        super().__init__(name, on_exception)
        self._calls: deque[Callable[[], object]] = deque()
        self._running: dict[int, object] = {}  # the current callback of each thread
        self._executor: WaitSetExecutor = (
            SingleThreadedWaitSetExecutor(self)
            if threads is None
            else MultiThreadedWaitSetExecutor(self, threads)
        )
        self._timers = TimerThread(self, f"executor {name}, timers")
        self._thread = threading.Thread(target=self._spin, name=f"executor {name}", daemon=True)

    # --- entities

    def add_node(self, node: Node) -> None:
        """Serve the entities that rclpy creates for a node."""
        self._executor.serve_node(node)

    def remove_node(self, node: Any) -> None:
        """Stop serving the node and all its entities."""
        node.executor = None
        self._executor.wake()

    def remove(self, entity: object) -> None:
        """Stop serving an entity. Call it before the entity is destroyed."""
        self._executor.forget(entity)

    @property
    def _rclpy_executor(self) -> object:
        return self._executor

    def _serve(self, entity: object, source: EntitySource) -> None:
        self._executor.serve(entity, source)

    # --- calls

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""
        # rclpy's executors start the latest task first; the deque makes it the oldest.
        self._calls.append(callback)
        if not self._stopped:
            self._executor.call_soon(self._call_next)

    def _schedule(self, call: ScheduledCall) -> ScheduledCall:
        return self._timers.add(call)

    # --- the threads

    def start(self) -> None:
        """Start the threads of the loop."""
        self._timers.start()
        self._thread.start()

    def native_thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""
        threads = (self._thread, self._timers.thread, *self._executor.threads)
        return tuple(thread.native_id or 0 for thread in threads)

    def stop(self, timeout_s: float) -> bool:
        """Stop the threads; return false if a callback did not return in time.

        Tasks are canceled and get a moment to clean up. On the loop itself, this requests the stop
        and returns false.
        """
        until_s = monotonic() + timeout_s
        self._timers.stop()
        for task in list(self._tasks):
            task.future.cancel()
        is_current = self.is_current()
        if self._thread.ident is not None and not is_current:
            self._wait_for_tasks(min(until_s, monotonic() + _CLEAN_UP_S))
        self._stopping = True
        self._end_waits()
        self._executor.end()
        if is_current:
            return False
        if self._thread.ident is not None:
            self._thread.join(max(0.0, until_s - monotonic()))
        ended = self._executor.join(until_s) and not self._thread.is_alive()
        self._stopped = True
        if ended:
            self._make_final_calls()
        else:
            for task in tuple(self._tasks):
                task.abandon()
        return ended

    def busy_threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
        return tuple(self._running)

    def call(self, name: Callable[[], str], callback: Callable[[], object]) -> None:
        """Call ``callback`` on the current thread and report its exception."""
        ident = threading.get_ident()
        outer = self._running.get(ident)
        self._running[ident] = callback
        try:
            callback()
        except BaseException as error:
            self.report(name(), error)
        finally:
            if outer is None:
                del self._running[ident]
            else:
                self._running[ident] = outer

    def is_current(self) -> bool:
        """Return whether the calling thread belongs to the loop."""
        return threading.get_ident() in self._running

    def _spin(self) -> None:
        while not self._stopping:
            try:
                if not self._executor.spin_one():
                    return
            except BaseException as error:
                self.report(f"executor '{self._name}'", error)
                sleep(PAUSE_AFTER_FAULT_S)

    def _call_next(self) -> None:
        try:
            callback = self._calls.popleft()
        except IndexError:
            return
        self.call(lambda: name_of(callback), callback)

    def _wait_for_tasks(self, until_s: float) -> None:
        while self._tasks and monotonic() < until_s:
            sleep(0.001)

    def _make_final_calls(self) -> None:
        while self._calls:
            self._call_next()
        for task in list(self._tasks):
            task.close()
