"""A node that is implemented by an executable, in a child process.

*Configure* finds the program, *activate* starts it and waits for its ports, *deactivate* ends it:
an inactive node must not publish, and a plain program knows no other way to be silent. With
``lifecycle: managed``, *configure* starts the program and *cleanup* ends it; its own services do
the rest.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from composer.base.regular_files import write_whole
from composer.model import Executable, ExecutableKind, LifecycleKind, LogLevel, Node
from composer.runtime.callbacks.log import severity
from composer.runtime.children.child_processes import Child, Command, StartFailed
from composer.runtime.children.command_line import NotRunnable, make_command, parameter_file
from composer.runtime.children.output import attribute_line
from composer.runtime.executors.exceptions import printable
from composer.runtime.outside_nodes.outside_node import (
    INACTIVE,
    UNCONFIGURED,
    OutsideContext,
    OutsideNode,
    TransitionRefused,
    elsewhere_text,
    missing_text,
)
from composer.runtime.outside_nodes.remote_node import NodePresence, NotAnswered, RemoteLifecycle

#: How long a killed process may take to disappear.
_KILLED_WITHIN_S = 1.0
#: How long after the first node of a program its other ones are in the graph, usually.
_ALL_NODES_WITHIN_S = 1.0
#: The longest share of the time that is left for the shutdown of the system.
_END_SHARE = 0.5


class ExecutableNode(OutsideNode):
    """The :class:`.ManagedNode` of an executable."""

    def __init__(self, model: Node, executable: Executable, context: OutsideContext) -> None:
        super().__init__(model, context)
        self._executable = executable
        self._children = context.children
        self._log_level = context.log_level
        self._manager = context.manager
        self._presence = NodePresence(self._manager, model)
        self._earlier: frozenset[bytes] = frozenset()  # participants of earlier processes
        self._command: Command | None = None
        self._child: Child | None = None
        self._remote: RemoteLifecycle | None = None

    @property
    def transition_timeout_s(self) -> float:
        """How long a transition may take: the start and the end of the process included."""
        limits_s = self._executable.ready_timeout_s + sum(self._end_limits_s)
        return self._timeout_s + limits_s + _KILLED_WITHIN_S

    @property
    def pid(self) -> int | None:
        """The process id, None while no process runs."""
        return None if self._child is None else self._child.pid

    @property
    def figures(self) -> Mapping[str, Any]:
        """Its process; its rates and counters are not known."""
        return {"pid": str(self.pid or "")}

    def destroy(self) -> None:
        """Kill the process, if there is one, without waiting for that."""
        if self._child is not None:
            self._children.end(self._child, 0.0, 0.0)
            self._child = None
        self._close_remote()

    @property
    def _is_managed(self) -> bool:
        return self._executable.lifecycle is LifecycleKind.MANAGED

    async def _work(self, transition: str) -> None:
        if self._is_managed:
            await self._work_managed(transition)
        elif transition == "configure":
            self._find()
        elif transition == "activate":
            await self._activate()
        elif transition in ("deactivate", "shutdown"):
            await self._end_process()

    async def _activate(self) -> None:
        child = await self._start(INACTIVE)
        end_s = self.loop.clock.monotonic() + self._executable.ready_timeout_s
        if self._executable.kind is ExecutableKind.TASK:
            await self._finish_task(child, end_s)
            return
        ready = partial(self._is_ready, child)
        if not await self._until_ready(ready, end_s) or child.ended.done():
            missing = self._presence.missing(self._earlier)
            reason = _ended(child) or self._not_ready(child, missing_text(missing))
            await self._end_process()
            raise TransitionRefused(reason, INACTIVE)
        self._check_names_later(child)

    def _not_ready(self, child: Child, missing: str) -> str:
        """Return why its process is not ready in time, with the nodes that it has instead."""
        names = set() if child.pid is None else self._presence.names_in(child.pid)
        limit = f"after {_seconds(self._executable)}"
        return f"{missing} {limit}{elsewhere_text(self.model, names)}"

    async def _finish_task(self, child: Child, end_s: float) -> None:
        if not await self._until_ready(child.ended.done, end_s):
            await self._end_process()
            raise TransitionRefused(f"still running after {_seconds(self._executable)}", INACTIVE)
        self._child = None
        if _status(child) != 0:
            raise TransitionRefused(_ended(child), INACTIVE)

    def _is_ready(self, child: Child) -> bool:
        return child.ended.done() or (
            self._presence.has_node(self._earlier) and not self._presence.missing(self._earlier)
        )

    # --- lifecycle: managed

    async def _work_managed(self, transition: str) -> None:
        if transition == "configure":
            await self._connect()
        if transition == "shutdown":
            await self._end_process()  # whatever its service would answer
        else:
            await self._change(transition)
        if transition == "cleanup":
            await self._end_process()

    async def _connect(self) -> None:
        """Start the process unless it runs, and wait for its lifecycle services."""
        if self._child is not None and self._remote is not None:
            return
        self._find()
        child = await self._start(UNCONFIGURED)
        self._remote = RemoteLifecycle(self._manager, self.loop, self.full_name, self._on_state)
        end_s = self.loop.clock.monotonic() + self._executable.ready_timeout_s
        service = f"{self.full_name}/change_state"

        def has_services() -> bool:
            return child.ended.done() or self._presence.has_service(service, self._earlier)

        if await self._until_ready(has_services, end_s) and not child.ended.done():
            self._check_names_later(child)
            return
        reason = _ended(child) or self._not_ready(child, f"no service {service}")
        await self._end_process()
        raise TransitionRefused(reason, UNCONFIGURED)

    async def _change(self, transition: str) -> None:
        """Run a transition of the node by its services."""
        child, remote = self._child, self._remote
        if child is None or remote is None:
            raise TransitionRefused("its process does not run", UNCONFIGURED)
        limit_s = self._timeout_s
        if self._end_s is not None:
            limit_s = min(limit_s, max(0.0, self._end_s - self.loop.clock.monotonic()) * _END_SHARE)
        request = self.loop.run_task(
            remote.change(transition, self.loop.clock.monotonic() + limit_s)
        )
        child.ended.add_done_callback(lambda _: request.cancel())
        try:
            await self._until(request.done, float("inf"))
            if request.cancelled():
                await self._end_process()
                raise TransitionRefused(_ended(child), UNCONFIGURED)
            success, state = request.result()
        except NotAnswered as error:
            await self._end_process()
            text = f"{error} within {limit_s:.3g} s; its process was ended"
            raise TransitionRefused(text, UNCONFIGURED) from error
        if not success:
            raise TransitionRefused(f"its service reports a failure; it is {state}", state)

    def _close_remote(self) -> None:
        if self._remote is not None:
            self._remote.close()
            self._remote = None

    # --- the process

    def _find(self) -> None:
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
        await self._end_process()
        self._earlier = self._presence.participants()
        try:
            command = self._with_parameters(self._command)
            child = self._children.start(command, self._log)
            await child.started
        except (OSError, StartFailed) as error:
            raise TransitionRefused(f"cannot be started: {error}", state) from error
        self._child = child
        child.ended.add_done_callback(
            lambda _: self.loop.call_soon(partial(self._on_process_end, child))
        )
        return child

    def _with_parameters(self, command: Command) -> Command:
        text = parameter_file(self.model)
        if not text:
            return command
        path = self._children.prepare() / f"{self._logger}.yaml"
        write_whole(path, text)
        return replace(command, words=(*command.words, "--params-file", str(path)))

    def _check_names_later(self, child: Child) -> None:
        """Report several nodes in a program that all got the name of this one."""
        self.loop.call_later(_ALL_NODES_WITHIN_S, partial(self._check_names, child))

    def _check_names(self, child: Child) -> None:
        count = self._presence.namesakes(self._earlier)
        if child is self._child and not self.model.keeps_names and count > 1:
            self._listener.write_log(
                LogLevel.WARN,
                self._logger,
                f"its program creates {count} nodes, and all of them are named"
                f" '{self.model.ros_name.value}'; list the names that they have in the program"
                " under 'nodes' of the executable",
            )

    async def _end_process(self) -> None:
        """End the process in order, and wait for that."""
        child = self._child
        self._close_remote()
        if child is None:
            return
        self._child = None  # its end is expected
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
        if self._end_s is None:
            return terminate_s, kill_s
        left_s = max(0.0, self._end_s - self.loop.clock.monotonic()) * _END_SHARE
        share = min(1.0, left_s / max(terminate_s + kill_s, 1e-3))
        return terminate_s * share, kill_s * share

    def _on_process_end(self, child: Child) -> None:
        """Report the end of the process as a fault, unless it was expected."""
        if child is self._child and not self._lock.is_held:
            self._child = None
            self._close_remote()
            self._fail(_ended(child))

    def _on_settled(self) -> None:
        if self._child is not None and self._child.ended.done():
            self._on_process_end(self._child)

    def _log(self, text: str, is_error: bool) -> None:
        level, logger, message = attribute_line(text, (self._logger,), is_error=is_error)
        if severity(level) >= severity(self._log_level):
            self._listener.write_log(level, logger, printable(message))


def _status(child: Child) -> int | None:
    """Return how a process has ended; None if it never started."""
    return None if child.ended.cancelled() else child.ended.result()


def _ended(child: Child) -> str:
    """Return how a process has ended, in words; empty while it runs."""
    if not child.ended.done():
        return ""
    return f"its process {child.how_ended or 'has not started'}"


def _seconds(executable: Executable) -> str:
    return f"{executable.ready_timeout_s:g} s"
