"""rclpy's executors, mended: what they serve and how, but nothing a callback does ends them.

They stand on private parts of rclpy 7.1: ``_take_*`` (what is done with a ready entity) and
``_tasks`` (the handlers that are not done yet). What rclpy does by itself, and these do not:

- an exception in a callback leaves ``spin``;
- MultiThreadedExecutor hands a handler to its pool again and again until a thread begins it, so
  that all threads busy means one more at full load, and a flood means a standstill;
- its pool's threads keep the interpreter from exiting while a callback hangs.
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

from composer.runtime.executors import actions
from composer.runtime.executors.entity_sources import Source, comes_by_itself, source_of
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.node_executor import NodeExecutor
from composer.runtime.executors.scheduler import BUSY_S, MOMENT_S

_Execute = Callable[[], Coroutine[Any, Any, None]]
_ADDING = "to wait set: "  # what rclpy was at when it says "action client pointer is invalid"
_END = None  # what a thread of the pool finds in the queue when it is to end


class Calling(Loop, Protocol):
    """The loop an executor works for."""

    def call(self, name: Callable[[], str], callback: Callable[[], object]) -> None:
        """Call ``callback``; what it raises is reported."""

    def report(self, what: str, error: BaseException) -> None:
        """Tell of an exception."""


class MendedExecutor(Executor):
    """What both kinds have in common. A handler runs to its end on the thread that takes it up."""

    def __init__(self, loop: Calling) -> None:
        super().__init__()
        self._loop = loop
        self._for_nodes = NodeExecutor(loop, lambda: None)
        self._sources: dict[object, Source] = {}  # of the entities that were added by themselves
        self._served: WeakSet[Any] = WeakSet()
        self._ending = False
        self._busy_until_s = 0.0
        self.threads: list[threading.Thread] = []  # those beside the one that calls turn

    def serve(self, entity: object, source: Source | None) -> None:
        """Serve an entity by ``source``, or as rclpy does."""
        if source is not None:
            self._sources[entity] = source
        self._served.add(entity)
        self.wake()

    def serve_all_of(self, node: Any) -> None:
        """Serve what the node has by now, as rclpy does."""
        for entities in (node.subscriptions, node.services, node.clients, node.waitables):
            self._served.update(entities)
        self.add_node(node)

    def forget(self, entity: object) -> None:
        """Serve an entity no more."""
        self._served.discard(entity)
        self._sources.pop(entity, None)
        self.wake()

    def call_soon(self, callback: Callable[[], object]) -> None:
        """Call ``callback``, which must not raise, on a thread of the executor."""
        super().create_task(callback)

    def create_task(  # type: ignore[override]  # no Task of rclpy's: those are polled
        self, callback: Callable[..., Any], *args: Any, **kwargs: Any
    ) -> RclpyFuture:
        """Call ``callback``, plain or ``async def``, on the loop: rclpy's action servers ask."""
        return self._for_nodes.create_task(callback, *args, **kwargs)

    def can_execute(self, entity: Any) -> bool:
        """Leave out what nobody added: its callback may not be the one it is for."""
        served = entity in self._served or comes_by_itself(entity) or _is_rclpy_only(entity)
        return served and bool(super().can_execute(entity))

    def turn(self) -> bool:
        """Wait for a handler and run it; false when there will be none any more."""
        try:
            handler, _, _ = self.wait_for_ready_callbacks(None, None, self._is_ending)
        except (ConditionReachedException, ShutdownException, ExternalShutdownException):
            return False
        except InvalidHandle:
            return True  # an entity was destroyed between the wait and the look at its result
        except RCLError as error:
            if _ADDING not in str(error):
                raise
            return True  # rclpy finds that an action is destroyed, and adds it nonetheless
        self._run(handler)
        return True

    def end(self) -> None:
        """Have :meth:`turn` answer false."""
        self._ending = True
        self.wake()

    def finish(self, until_s: float) -> bool:  # noqa: ARG002
        """End what works for the executor, after the last turn; false when it takes too long."""
        return True

    def _is_ending(self) -> bool:
        """Asked before each wait: also the time to let other threads have their turn."""
        now_s = monotonic()
        if now_s > self._busy_until_s:
            sleep(MOMENT_S)
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
            self._loop.run_task(actions.forget_expired_goals(waitable))
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


class MendedSingleThreadedExecutor(MendedExecutor, SingleThreadedExecutor):
    """One thread: the one that calls :meth:`turn`."""


class MendedMultiThreadedExecutor(MendedExecutor):
    """A pool of threads, and one that waits for them."""

    def __init__(self, loop: Calling, threads: int) -> None:
        super().__init__(loop)
        self._handlers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self.threads = [
            threading.Thread(target=self._work, name=f"{loop.name} {number}", daemon=True)
            for number in range(1, threads + 1)
        ]
        for thread in self.threads:
            thread.start()

    def finish(self, until_s: float) -> bool:
        """End the pool."""
        for _ in self.threads:
            self._handlers.put(_END)
        for thread in self.threads:
            thread.join(max(0.0, until_s - monotonic()))
        return not any(thread.is_alive() for thread in self.threads)

    def _run(self, handler: Any) -> None:
        with self._tasks_lock:  # or the next turn finds it again
            self._tasks = [entry for entry in self._tasks if entry[0] is not handler]
        self._handlers.put(handler)

    def _work(self) -> None:
        while (handler := self._handlers.get()) is not _END:
            handler()
            if not handler.done():  # an async callback of a timer somebody gave the node
                with self._tasks_lock:
                    self._tasks.append((handler, None, None))
                self.wake()


def _is_rclpy_only(entity: object) -> bool:
    """Tell whether a loop has no way to be given the entity, so that it is served as it is."""
    return isinstance(entity, Timer | GuardCondition)


def _take(entity: Any, source: Source) -> Any:
    try:
        # In use, so that no other thread destroys it before it is taken from.
        with entity if isinstance(entity, Waitable) else entity.handle:
            return source.take()
    except InvalidHandle:
        return None  # destroyed since it was found ready
