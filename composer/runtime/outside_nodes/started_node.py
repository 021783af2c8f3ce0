"""Nodes that this process starts and ends, outside of itself: of executables, in child processes.

Those of components are in ``component_node``.
"""

from __future__ import annotations

import math
import os
from abc import abstractmethod
from collections.abc import Coroutine, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from composer.base.files import write_whole
from composer.model import SEVERITIES, Executable, ExecutableKind, LogLevel, Node, Outside
from composer.model.lifecycle import INACTIVE, UNCONFIGURED
from composer.runtime.children.child_processes import Child, Command, StartFailed
from composer.runtime.children.command_line import NotRunnable, make_command, parameter_file
from composer.runtime.children.output import attribute_line
from composer.runtime.executors.futures import Future
from composer.runtime.executors.tracebacks import printable
from composer.runtime.outside_nodes.outside_node import (
    ObservedNode,
    OutsideContext,
    TransitionRefused,
    elsewhere_text,
)
from composer.runtime.outside_nodes.remote_node import NotAnswered

#: The longest share of the time that is left for the shutdown of the system.
END_SHARE = 0.5
#: How long a killed process may take to disappear.
_KILLED_WITHIN_S = 1.0
#: How long after the first node of a program its other ones are in the graph, usually.
_ALL_NODES_WITHIN_S = 1.0
T = TypeVar("T")


class Run(Protocol):
    """What has been started: a process, or a loaded component."""

    @property
    def ended(self) -> Future[Any]:
        """Done once it has ended, by itself or not."""


R = TypeVar("R", bound=Run)


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
        return min(limit_s, self._left_s())

    def _left_s(self) -> float:
        """Return how long something may take: a share of the time for the shutdown, if any."""
        end_s = self._run_state.end_s
        if end_s is None:
            return math.inf
        return max(0.0, end_s - self.loop.clock.monotonic()) * END_SHARE

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


class ExecutableNode(StartedNode[Child]):
    """The :class:`.ManagedNode` of an executable."""

    _when_silent = "its process was ended"

    def __init__(self, model: Node, executable: Executable, context: OutsideContext) -> None:
        super().__init__(model, executable, context)
        self._executable = executable
        self._children = context.children
        self._command: Command | None = None
        self._last: Child | None = None

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take: the start and the end of the process included."""
        limits_s = self._executable.ready_timeout_s + sum(self._end_limits_s)
        return self._timeout_s + limits_s + _KILLED_WITHIN_S

    @property
    def pid(self) -> int | None:
        """The process id, None while no process runs."""
        return None if self._started is None else self._started.pid

    @property
    def has_finished(self) -> bool:
        """Whether its last process has ended itself, with exit status 0."""
        last = self._last
        if last is None or last.is_ending or not last.ended.done():
            return False
        return _status(last) == 0

    @property
    def figures(self) -> Mapping[str, Any]:
        """Its process; its rates and counters are not known."""
        return {"pid": str(self.pid or "")}

    def destroy(self) -> None:
        """Kill the process, if there is one, without waiting for that."""
        if self._started is not None:
            self._children.end(self._started, 0.0, 0.0)
            self._started = None
        self._close_remote()

    async def _activate(self) -> None:
        if self._executable.kind is not ExecutableKind.TASK:
            await super()._activate()
            return
        child = await self._start(INACTIVE)
        end_s = self.loop.clock.monotonic() + self._executable.ready_timeout_s
        if not await self._until_ready(child.ended.done, end_s):
            await self._end()
            limit = f"{self._executable.ready_timeout_s:g} s"
            raise TransitionRefused(f"still running after {limit}", INACTIVE)
        self._started = None
        if _status(child) != 0:
            raise TransitionRefused(self._how_ended(child), INACTIVE)

    def _not_ready(self, run: Child, missing: str) -> str:
        """Return why its process is not ready in time, with the nodes that it has instead."""
        names = set() if run.pid is None else self.presence.names_in(run.pid)
        return super()._not_ready(run, missing) + elsewhere_text(self.model, names)

    # --- the process

    def _find(self) -> None:
        self._last = None
        try:
            self._command = make_command(self.model, self._executable, self._log_level, os.environ)
        except NotRunnable as error:
            raise TransitionRefused(str(error), UNCONFIGURED) from error
        folder = self._command.folder
        if folder is not None and not folder.is_dir():
            text = f"working directory '{folder}' does not exist"
            raise TransitionRefused(text, UNCONFIGURED)

    async def _start(self, state: str) -> Child:
        """Start the process; if that fails, the node is in ``state``."""
        if self._command is None:
            raise TransitionRefused("its program was not found", UNCONFIGURED)
        await self._end()
        self.presence.earlier = self.presence.participants()
        try:
            command = self._with_parameters(self._command)
            child = self._children.start(command, self._log)
            await child.started
        except (OSError, StartFailed) as error:
            raise TransitionRefused(f"cannot be started: {error}", state) from error
        self._watch(child)
        self._last = child
        return child

    def _with_parameters(self, command: Command) -> Command:
        text = parameter_file(self.model)
        if not text:
            return command
        path = self._children.prepare() / f"{self._logger}.yaml"
        write_whole(path, text)
        return replace(command, words=(*command.words, "--params-file", str(path)))

    def _on_ready(self, run: Child) -> None:
        """Report several nodes in a program that all got the name of this one."""
        self.loop.call_later(_ALL_NODES_WITHIN_S, partial(self._check_names, run))

    def _check_names(self, child: Child) -> None:
        count = self.presence.namesakes()
        if child is self._started and not self.model.keeps_names and count > 1:
            self._listener.write_log(
                LogLevel.WARN,
                self._logger,
                f"its program creates {count} nodes, and all of them are named"
                f" '{self.model.ros_name.value}'; list the names that they have in the program"
                " under 'nodes' of the executable",
            )

    async def _end(self) -> None:
        child = self._started
        self._close_remote()
        if child is None:
            return
        self._started = None  # its end is expected
        terminate_s, kill_s = self._end_limits_s
        self._children.end(child, terminate_s, kill_s)
        end_s = self.loop.clock.monotonic() + terminate_s + kill_s + _KILLED_WITHIN_S
        if not await self._until(child.ended.done, end_s):
            raise TransitionRefused(f"process {child.pid} cannot be killed", UNCONFIGURED)

    @property
    def _end_limits_s(self) -> tuple[float, float]:
        """How long to wait after SIGINT and after SIGTERM; less if the system shuts down."""
        terminate_s = self._executable.sigterm_timeout_ms / 1000.0
        kill_s = self._executable.sigkill_timeout_ms / 1000.0
        share = min(1.0, self._left_s() / max(terminate_s + kill_s, 1e-3))
        return terminate_s * share, kill_s * share

    def _how_ended(self, run: Child) -> str:
        if not run.ended.done():
            return ""
        return f"its process {run.how_ended or 'has not started'}"

    def _log(self, text: str, is_error: bool) -> None:
        level, logger, message = attribute_line(text, (self._logger,), is_error=is_error)
        if SEVERITIES[level] >= SEVERITIES[self._log_level]:
            self._listener.write_log(level, logger, printable(message))


def _status(child: Child) -> int | None:
    """Return how a process has ended; None if it never started."""
    return None if child.ended.cancelled() else child.ended.result()
