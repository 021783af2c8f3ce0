"""A node that this process starts and ends, outside of itself: an executable, or a component."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Coroutine
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from composer.model import Node, Outside
from composer.model.lifecycle import INACTIVE, UNCONFIGURED
from composer.runtime.executors.futures import Future
from composer.runtime.outside_nodes.outside_node import (
    ObservedNode,
    OutsideContext,
    TransitionRefused,
)
from composer.runtime.outside_nodes.remote_node import NotAnswered

#: The longest share of the time that is left for the shutdown of the system.
END_SHARE = 0.5


class Run(Protocol):
    """What has been started: a process, or a loaded component."""

    @property
    def ended(self) -> Future[Any]:
        """Done once it has ended, by itself or not."""


R = TypeVar("R", bound=Run)
T = TypeVar("T")


class Ended(Exception):
    """What has been started has ended meanwhile."""


class StartedNode(ObservedNode, Generic[R]):
    """The :class:`.ManagedNode` of a node that this process starts and ends.

    *Configure* looks for it, *activate* starts it and waits for its ports, *deactivate* ends it: an
    inactive node must not publish, and a plain node knows no other way to be silent. With
    ``lifecycle: managed``, *configure* starts it and *cleanup* ends it; its own services do the
    rest.
    """

    #: What becomes of a node that does not answer.
    _when_silent: str

    def __init__(self, model: Node, outside: Outside, context: OutsideContext) -> None:
        super().__init__(model, outside, context)
        self._log_level = context.log_level
        self._started: R | None = None

    @abstractmethod
    def _find(self) -> None:
        """Look for what is to be started. Raises TransitionRefused."""

    @abstractmethod
    async def _start(self, state: str) -> R:
        """Start it; if that fails, raise TransitionRefused with ``state``."""

    @abstractmethod
    async def _end(self) -> None:
        """End it in order, if it runs, and wait for that. Raises TransitionRefused."""

    @abstractmethod
    def _how_ended(self, run: R) -> str:
        """Return how it has ended, in words; empty while it runs."""

    def _not_ready(self, run: R, missing: str) -> str:  # noqa: ARG002 (for subclasses)
        """Return why it is not ready in time."""
        return f"{missing} after {self._outside.ready_timeout_s:g} s"

    def _on_ready(self, run: R) -> None:
        """React to the start."""

    async def _work(self, transition: str) -> None:
        if self._outside.is_managed:
            await self._work_managed(transition)
        elif transition == "configure":
            self._find()
        elif transition == "activate":
            await self._activate()
        elif transition in ("deactivate", "shutdown"):
            await self._end()

    async def _activate(self) -> None:
        await self._await(await self._start(INACTIVE), INACTIVE)

    async def _await(self, run: R, state: str) -> None:
        """Wait until it is ready. Otherwise, end it, and raise TransitionRefused with ``state``."""
        end_s = self.loop.clock.monotonic() + self._outside.ready_timeout_s
        ended = run.ended
        is_over = await self._until_ready(lambda: ended.done() or self._is_there(), end_s)
        if is_over and not ended.done():
            self._on_ready(run)
            return
        reason = self._how_ended(run) or self._not_ready(run, self._missing())
        await self._end()
        raise TransitionRefused(reason, state)

    # --- lifecycle: managed

    async def _work_managed(self, transition: str) -> None:
        if transition == "configure":
            await self._connect()
        if transition == "shutdown":
            await self._end()  # whatever its service would answer
        else:
            await self._change(transition)
        if transition == "cleanup":
            await self._end()

    async def _connect(self) -> None:
        """Start it unless it runs, and wait for its lifecycle services."""
        if self._started is not None and self._remote is not None:
            return
        self._find()
        run = await self._start(UNCONFIGURED)
        self._connect_remote()
        await self._await(run, UNCONFIGURED)

    async def _change(self, transition: str) -> None:
        """Run a transition of the node by its services."""
        run, remote = self._started, self._remote
        if run is None or remote is None:
            raise TransitionRefused("it does not run", UNCONFIGURED)
        limit_s = self._limit_s(self._timeout_s)
        try:
            change = remote.change(transition, self.loop.clock.monotonic() + limit_s)
            success, state = await self._while_it_runs(run, change)
        except Ended as error:
            await self._end()
            raise TransitionRefused(self._how_ended(run), UNCONFIGURED) from error
        except NotAnswered as error:
            await self._end()
            text = f"{error} within {limit_s:.3g} s; {self._when_silent}"
            raise TransitionRefused(text, UNCONFIGURED) from error
        if not success:
            raise TransitionRefused(f"its service reports a failure; it is {state}", state)

    async def _while_it_runs(self, run: R, request: Coroutine[Any, Any, T]) -> T:
        """Return what ``request`` returns, and raise what it raises. Raises Ended."""
        task = self.loop.run_task(request)
        run.ended.add_done_callback(lambda _: task.cancel())
        await self._until(task.done, float("inf"))
        if task.cancelled():
            raise Ended
        return task.result()

    def _limit_s(self, limit_s: float) -> float:
        """Return a time limit in seconds, shortened while the system shuts down."""
        if self._end_s is None:
            return limit_s
        return min(limit_s, max(0.0, self._end_s - self.loop.clock.monotonic()) * END_SHARE)

    # --- its end

    def _watch(self, run: R) -> None:
        """Report the end of ``run`` as a fault, unless it is expected."""
        self._started = run
        run.ended.add_done_callback(lambda _: self.loop.call_soon(partial(self._on_end, run)))

    def _on_end(self, run: R) -> None:
        if run is self._started and not self._lock.is_held:
            self._started = None
            self._close_remote()
            self._fail(self._how_ended(run), is_awaited=self._is_lost)

    def _on_settled(self) -> None:
        if self._started is not None and self._started.ended.done():
            self._on_end(self._started)
