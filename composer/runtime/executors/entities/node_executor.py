"""The object that is ``node.executor`` under the composer's own loop."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.task import Future as RclpyFuture

from composer.runtime.executors.loop import Loop
from composer.runtime.executors.tasks import name_of


class NodeExecutor:
    """The part of ``rclpy.executors.Executor`` that rclpy's own code uses of ``node.executor``.

    An ActionServer runs goals by ``create_task``, rclpy's futures their done callbacks. A node
    calls ``wake`` when one of its entities was created or destroyed.
    """

    def __init__(self, loop: Loop, on_wake: Callable[[], None]) -> None:
        self._loop = loop
        self._on_wake = on_wake

    def create_task(self, callback: Callable[..., Any], *args: Any, **kwargs: Any) -> RclpyFuture:
        """Call ``callback``, plain or ``async def``, on the loop; return the future of its result.

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
        """Check the node's entities soon."""
        self._on_wake()

    def add_node(self, node: object) -> None:
        """Do nothing: nodes are added by ``Loop.add_node``."""

    def remove_node(self, node: object) -> None:
        """Do nothing: nodes are removed by ``Loop.remove_node``."""
