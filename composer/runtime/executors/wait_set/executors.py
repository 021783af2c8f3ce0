"""rclpy's wait-set executors, changed so that no callback can end or stall them.

They depend on private parts of rclpy 7.1: ``_take_*``, which handle a ready entity, and ``_tasks``,
the handlers that are not done yet. They fix three problems of rclpy:

- An exception in a callback leaves ``spin``.
- MultiThreadedExecutor submits a handler to its pool again and again until a thread starts it. With
  all threads busy, that keeps one more at full load, and a flood of messages stalls the executor.
- The pool's threads keep the interpreter from exiting while a callback is blocked.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Coroutine
from time import monotonic, sleep
from typing import Any, Protocol
from weakref import WeakSet

from rclpy._rclpy_pybind11 import RCLError
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.event_handler import EventHandler
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ConditionReachedException,
    Executor,
    ExternalShutdownException,
    ShutdownException,
    SingleThreadedExecutor,
)
from rclpy.guard_condition import GuardCondition
from rclpy.task import Future as RclpyFuture
from rclpy.timer import Timer
from rclpy.waitable import Waitable

from composer.runtime.executors.base_loop import BUSY_S, YIELD_S
from composer.runtime.executors.entities.actions import expire_goals
from composer.runtime.executors.entities.node_executor import NodeExecutor
from composer.runtime.executors.entities.source_group import EntitySource
from composer.runtime.executors.entities.sources import is_implicit, source_of
from composer.runtime.executors.loop import Loop

_Execute = Callable[[], Coroutine[Any, Any, None]]
_ADDING = "to wait set: "  # part of rclpy's message "action client pointer is invalid"
_END = None  # ends the thread of the pool that gets it


class CallingLoop(Loop, Protocol):
    """The loop of an executor."""

    def call(self, name: Callable[[], str], callback: Callable[[], object]) -> None:
        """Call ``callback`` and report its exception."""

    def report(self, what: str, error: BaseException) -> None:
        """Report an exception."""


class WaitSetExecutor(Executor):
    """The base of both kinds. A handler runs to completion on the thread that starts it."""

    def __init__(self, loop: CallingLoop) -> None:
        super().__init__()
        self._loop = loop
        self._node_executor = NodeExecutor(loop, lambda: None)
        self._sources: dict[object, EntitySource] = {}  # of the entities that were added
        self._served: WeakSet[Any] = WeakSet()
        self._ending = False
        self._busy_until_s = 0.0
        self.threads: list[threading.Thread] = []  # other than the one that calls spin_one

    def serve(self, entity: object, source: EntitySource) -> None:
        """Serve an entity by ``source``."""
        self._sources[entity] = source
        self._served.add(entity)
        self.wake()

    def serve_node(self, node: Any) -> None:
        """Serve the present entities of a node as rclpy does."""
        for entities in (node.subscriptions, node.services, node.clients, node.waitables):
            self._served.update(entities)
        self.add_node(node)

    def forget(self, entity: object) -> None:
        """Stop serving an entity."""
        self._served.discard(entity)
        self._sources.pop(entity, None)
        self.wake()

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback``, which must not raise, on a thread of the executor."""
        super().create_task(callback)

    def create_task(  # type: ignore[override]  # not rclpy's Task, which is polled
        self, callback: Callable[..., Any], *args: Any, **kwargs: Any
    ) -> RclpyFuture:
        """Call ``callback``, plain or ``async def``, on the loop: for rclpy's action servers."""
        return self._node_executor.create_task(callback, *args, **kwargs)

    def can_execute(self, entity: Any) -> bool:
        """Skip entities that were not added: their final callback may not be set yet."""
        served = entity in self._served or is_implicit(entity) or _is_rclpy_only(entity)
        return served and bool(super().can_execute(entity))

    def spin_one(self) -> bool:
        """Wait for a handler and run it; return false once the executor has ended."""
        try:
            handler, _, _ = self.wait_for_ready_callbacks(None, None, self._is_ending)
        except (ConditionReachedException, ShutdownException, ExternalShutdownException):
            return False
        except InvalidHandle:
            return True  # an entity was destroyed between the wait and reading its result
        except RCLError as error:
            if _ADDING not in str(error):
                raise
            return True  # rclpy has added an action that is destroyed
        self._run(handler)
        return True

    def end(self) -> None:
        """Make :meth:`spin_one` return false."""
        self._ending = True
        self.wake()

    def join(self, until_s: float) -> bool:  # noqa: ARG002
        """End the other threads, after the last spin; return false if that takes too long."""
        return True

    def _is_ending(self) -> bool:
        """Return whether to end. Called before each wait, it also lets other threads run."""
        now_s = monotonic()
        if now_s > self._busy_until_s:
            sleep(YIELD_S)
            self._busy_until_s = now_s + BUSY_S
        return self._ending

    def _run(self, handler: Any) -> None:
        handler()

    def _take_entity(self, entity: Any) -> _Execute | None:
        source = self._sources.get(entity) or source_of(entity, self, self._loop.run_task)
        if source is None:
            return None
        taken: list[Any] = []
        self._loop.call(lambda: source.name, lambda: taken.append(_take(entity, source)))
        if not taken or taken[0] is None:
            return None

        async def execute() -> None:
            self._loop.call(lambda: source.name, lambda: source.call(taken[0]))

        return execute

    _take_subscription = _take_service = _take_client = _take_entity

    def _take_waitable(self, waitable: Any) -> _Execute | None:
        if isinstance(waitable, EventHandler):
            waitable._ready_to_take_data = False
            return self._take_entity(waitable)
        if isinstance(waitable, ActionServer) and waitable._is_goal_expired:
            self._loop.run_task(expire_goals(waitable))
            return None
        if isinstance(waitable, ActionServer | ActionClient):
            return self._take_entity(waitable)
        return self._contained(waitable, super()._take_waitable)

    def _take_timer(self, timer: Any) -> _Execute | None:
        return self._contained(timer, super()._take_timer)

    def _take_guard_condition(self, guard: Any) -> _Execute | None:
        return self._contained(guard, super()._take_guard_condition)

    def _contained(self, entity: Any, take: Callable[[Any], _Execute | None]) -> _Execute | None:
        inner = take(entity)
        if inner is None:
            return None

        async def execute() -> None:
            try:
                await inner()
            except BaseException as error:
                self._loop.report(type(entity).__name__, error)

        return execute


class SingleThreadedWaitSetExecutor(WaitSetExecutor, SingleThreadedExecutor):
    """One thread: the one that calls :meth:`spin_one`."""


class MultiThreadedWaitSetExecutor(WaitSetExecutor):
    """A pool of threads, and one thread that waits for entities."""

    def __init__(self, loop: CallingLoop, threads: int) -> None:
        super().__init__(loop)
        self._handlers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.threads = [
            threading.Thread(target=self._work, name=f"{loop.name} {number}", daemon=True)
            for number in range(1, threads + 1)
        ]
        for thread in self.threads:
            thread.start()

    def join(self, until_s: float) -> bool:
        """End the pool; return false if that takes too long."""
        for _ in self.threads:
            self._handlers.put(_END)
        for thread in self.threads:
            thread.join(max(0.0, until_s - monotonic()))
        return not any(thread.is_alive() for thread in self.threads)

    def _run(self, handler: Any) -> None:
        with self._tasks_lock:  # or the next spin would find it again
            self._tasks = [entry for entry in self._tasks if entry[0] is not handler]
        self._handlers.put(handler)

    def _work(self) -> None:
        while (handler := self._handlers.get()) is not _END:
            handler()
            if not handler.done():  # an async callback of an rclpy timer
                with self._tasks_lock:
                    self._tasks.append((handler, None, None))
                self.wake()


def _is_rclpy_only(entity: object) -> bool:
    """Return whether a loop has no method to add such an entity, so that rclpy serves it."""
    return isinstance(entity, Timer | GuardCondition)


def _take(entity: Any, source: EntitySource) -> Any:
    try:
        # In use, so that no other thread destroys it before the take.
        with entity if isinstance(entity, Waitable) else entity.handle:
            return source.take()
    except InvalidHandle:
        return None  # destroyed since it was found ready
