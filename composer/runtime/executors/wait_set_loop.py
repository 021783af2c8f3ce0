"""The loops of ``kind: single_threaded`` and ``multi_threaded``: rclpy's executors on threads."""

from __future__ import annotations

import threading
import traceback
from collections import deque
from collections.abc import Callable, Coroutine
from time import monotonic, sleep
from typing import Any, TypeVar

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.node import Node
from rclpy.service import Service
from rclpy.subscription import Subscription

from composer.runtime.executors import actions
from composer.runtime.executors.cross_thread_call import Handover
from composer.runtime.executors.entity_sources import ServiceSource, SubscriptionSource
from composer.runtime.executors.loop import ExceptionHandler, Reply, Taken
from composer.runtime.executors.stacks import where
from composer.runtime.executors.tasks import Future, Task, name_of
from composer.runtime.executors.timer_queue import ScheduledCall
from composer.runtime.executors.timer_thread import TimerThread
from composer.runtime.executors.wait_set_executors import (
    MendedExecutor,
    MendedMultiThreadedExecutor,
    MendedSingleThreadedExecutor,
)

T = TypeVar("T")

_PAUSE_AFTER_FAULT_S = 0.01
_TIME_TO_CLEAN_UP_S = 0.2


class WaitSetLoop:
    """A :class:`~composer.runtime.executors.loop.Loop` on one of rclpy's executors.

    It runs once: start, then stop. ``threads`` None is the single-threaded executor.
    """

    def __init__(self, name: str, on_exception: ExceptionHandler, threads: int | None) -> None:
        self._name = name
        self._on_exception = on_exception
        self._calls: deque[Callable[[], object]] = deque()
        self._running: dict[int, object] = {}  # by thread: what it is calling
        self._tasks: set[Task[Any]] = set()
        self._stopping = False
        self._stopped = False
        self._executor: MendedExecutor = (
            MendedSingleThreadedExecutor(self)
            if threads is None
            else MendedMultiThreadedExecutor(self, threads)
        )
        self._timers = TimerThread(self, f"executor {name}, timers")
        self._thread = threading.Thread(target=self._spin, name=f"executor {name}", daemon=True)

    @property
    def name(self) -> str:
        """The name of the executor in YAML."""
        return self._name

    # --- entities

    def add_node(self, node: Node) -> None:
        """Serve what every node brings along."""
        self._executor.serve_all_of(node)

    def remove_node(self, node: Any) -> None:
        """Stop serving the node and everything of it."""
        node.executor = None
        self._executor.wake()

    def add_subscription(
        self, subscription: Subscription, callback: Callable[[Taken], None]
    ) -> None:
        """Call ``callback((message, information))`` for each message."""
        self._executor.serve(subscription, SubscriptionSource(subscription, callback))

    def add_service(self, service: Service, callback: Callable[[Any, Reply], None]) -> None:
        """Call ``callback(request, reply)``; ``reply(response)`` answers, now or later."""
        self._executor.serve(service, ServiceSource(service, callback))

    def add_client(self, client: Client) -> None:
        """Complete the futures of ``client.call_async``."""
        self._executor.serve(client, None)

    def add_action_server(self, server: ActionServer) -> None:
        """Run the server's goal, cancel and result requests."""
        actions.contain(server, self.report)
        self._executor.serve(server, self._action_source(server))

    def add_action_client(self, client: ActionClient) -> None:
        """Complete the futures of the client and deliver its feedback."""
        self._executor.serve(client, self._action_source(client))

    def _action_source(self, waitable: ActionServer | ActionClient) -> actions.ActionSource:
        return actions.ActionSource(waitable, self._executor, self)

    def remove(self, entity: object) -> None:
        """Stop serving one entity. To be called before it is destroyed."""
        self._executor.forget(entity)

    # --- calls

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback`` on the loop as soon as it is free."""
        # rclpy's executors take up the youngest first; by way of the deque it is the oldest.
        self._calls.append(callback)
        if not self._stopped:
            self._executor.call_soon(self._call_next)

    def call_later(self, delay_s: float, callback: Callable[[], object]) -> ScheduledCall:
        """Call ``callback`` once, ``delay_s`` seconds from now."""
        return self._timers.add(ScheduledCall(monotonic() + delay_s, None, callback))

    def call_every(self, period_s: float, callback: Callable[[], object]) -> ScheduledCall:
        """Call ``callback`` each ``period_s`` seconds; a late call does not shift the next.

        Raises ValueError for a period that is not positive.
        """
        return self._timers.add(ScheduledCall(monotonic() + period_s, period_s, callback))

    def run_task(self, coroutine: Coroutine[Any, Any, T]) -> Future[T]:
        """Run a coroutine; the future is its outcome. Cancelling the future closes it."""
        task = Task(coroutine, self.call_soon, self.report, self._tasks.discard)
        self._tasks.add(task)
        future = task.start()
        if self._stopped:
            task.abandon()
        return future

    def run(self, function: Callable[[], T], timeout_s: float | None = None) -> T:
        """Call ``function`` on the loop and wait for it (at once when already there).

        Raises what ``function`` raises, TimeoutError when it takes longer (it is not begun after
        that), and RuntimeError when the loop has stopped.
        """
        if threading.get_ident() in self._running:
            return function()
        handover = Handover(function)
        self.call_soon(handover.call)
        if self._stopped and handover.call_off():
            raise RuntimeError(f"executor '{self._name}' has stopped")
        return handover.wait(timeout_s, self.where)

    # --- the threads

    def start(self) -> None:
        """Begin to call, on threads of the loop's own."""
        self._timers.start()
        self._thread.start()

    def thread_ids(self) -> tuple[int, ...]:
        """Return Linux's ids of all threads of the loop, once it was started."""
        threads = (self._thread, self._timers.thread, *self._executor.threads)
        return tuple(thread.native_id or 0 for thread in threads)

    def stop(self, timeout_s: float) -> bool:
        """End the threads; false when a callback did not return in time.

        Tasks are cancelled and get a moment to clean up. Called on the loop itself, this asks for
        the end and answers false.
        """
        until_s = monotonic() + timeout_s
        self._timers.stop()
        for task in list(self._tasks):
            task.future.cancel()
        on_the_loop = threading.get_ident() in self._running
        if self._thread.ident is not None and not on_the_loop:
            self._wait_for_tasks(min(until_s, monotonic() + _TIME_TO_CLEAN_UP_S))
        self._stopping = True
        self._executor.end()
        if on_the_loop:
            return False
        if self._thread.ident is not None:
            self._thread.join(max(0.0, until_s - monotonic()))
        ended = self._executor.finish(until_s) and not self._thread.is_alive()
        self._stopped = True
        if ended:
            self._finish_calls()
        else:
            for task in tuple(self._tasks):
                task.abandon()
        return ended

    def where(self) -> str:
        """Return the Python stacks of the callbacks that run now; empty when none does."""
        return where(self.threads())

    def threads(self) -> tuple[int, ...]:
        """Return the identifiers of the threads that are in a callback now."""
        return tuple(self._running)

    def call(self, name: Callable[[], str], callback: Callable[[], object]) -> None:
        """Call ``callback`` on the current thread; what it raises is reported."""
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

    def report(self, what: str, error: BaseException) -> None:
        """Tell whoever handles exceptions."""
        try:
            self._on_exception(what, error)
        except BaseException:
            traceback.print_exc()  # the last resort: the handler itself failed

    def _spin(self) -> None:
        while not self._stopping:
            try:
                if not self._executor.turn():
                    return
            except BaseException as error:
                self.report(f"executor '{self._name}'", error)
                sleep(_PAUSE_AFTER_FAULT_S)  # a lasting fault must not fill the log in a second

    def _call_next(self) -> None:
        try:
            callback = self._calls.popleft()
        except IndexError:
            return
        self.call(lambda: name_of(callback), callback)

    def _wait_for_tasks(self, until_s: float) -> None:
        while self._tasks and monotonic() < until_s:
            sleep(0.001)

    def _finish_calls(self) -> None:
        while self._calls:
            self._call_next()
        for task in list(self._tasks):
            task.close()
