"""What ``node.executor`` is under the composer's own loop."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.task import Future as RclpyFuture

from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import name_of


class NodeExecutor:
    """As much of ``rclpy.executors.Executor`` as rclpy's own code asks of ``node.executor``.

    An ActionServer runs its goals by ``create_task``, rclpy's futures their done callbacks. A
    node calls ``wake`` when it got or lost an entity.
    """

    def __init__(self, loop: Loop, on_wake: Callable[[], None]) -> None:
        self._loop = loop
        self._on_wake = on_wake

    def create_task(self, callback: Callable[..., Any], *args: Any, **kwargs: Any) -> RclpyFuture:
        """Call ``callback``, plain or ``async def``, on the loop; the future is its result.

        An exception goes to the loop's handler.
        """
        outcome = RclpyFuture()

        def call() -> None:
            outcome.set_result(callback(*args, **kwargs))

        async def run() -> None:
            outcome.set_result(await callback(*args, **kwargs))

        call.__qualname__ = run.__qualname__ = name_of(callback)
        if inspect.iscoroutinefunction(callback):
            self._loop.call_soon(partial(self._loop.run_task, run()))
        else:
            self._loop.call_soon(call)
        return outcome

    def wake(self) -> None:
        """Look at what the node has, soon."""
        self._on_wake()

    def add_node(self, node: object) -> None:
        """Do nothing: nodes come by ``Loop.add_node``."""

    def remove_node(self, node: object) -> None:
        """Do nothing: nodes go by ``Loop.remove_node``."""
