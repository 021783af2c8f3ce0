"""The other processes of the system together, and what they keep for the next coordinating one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import partial

from composer.model import PrimaryState, System
from composer.plan import SystemGoals
from composer.runtime.callbacks.log import Write
from composer.runtime.children.child_processes import ChildProcesses
from composer.runtime.executors.loop import Loop
from composer.runtime.members.context import MemberContext
from composer.runtime.members.kept_goals import KeptGoals
from composer.runtime.members.process import MemberProcess
from composer.runtime.node.options import ProcessContext
from composer.runtime.process.computer import is_this_computer
from composer.runtime.protocol.reports import CallbackFigures, ChainFigures

_POLL_S = 0.01


class OtherProcesses:
    """The processes that this one coordinates; each exists with its first node.

    ``command`` starts them, and the nodes of one fail ``together``, as in :class:`.MemberContext`.
    """

    def __init__(
        self,
        system: System,
        namespace: str,
        command: Sequence[str],
        write_log: Write,
        together: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self._models = {process.name.value: process for process in system.processes}
        self._addresses = {host.name.value: host.address.value for host in system.hosts}
        self._namespace = namespace
        self._command = command
        self._write_log = write_log
        self._together = together
        self._goals = KeptGoals(system)
        self._processes: dict[str, MemberProcess] = {}
        self._loop: Loop  # set with the first process

    def process(
        self, name: str, loop: Loop, context: ProcessContext, children: ChildProcesses
    ) -> MemberProcess:
        """Return a process, for the first of its nodes a new one. All have the same loop."""
        if name not in self._processes:
            model = self._models[name]
            host = None if model.host is None else model.host.value
            is_local = host is None or is_this_computer(self._addresses[host])
            self._loop = loop
            self._processes[name] = MemberProcess(
                model,
                MemberContext(
                    loop=loop,
                    manager=context.manager,
                    children=children,
                    namespace=self._namespace,
                    command=self._command if is_local else (),
                    goals=self._goals,
                    write_log=self._write_log,
                    together=self._together,
                ),
            )
        return self._processes[name]

    def start_soon(self) -> None:
        """Start all that do not run, at once."""
        for process in self._all:
            process.start_soon()

    @contextmanager
    def requests_together(self) -> Iterator[None]:
        """Context manager: what is requested of a process becomes one request."""
        processes = self._all
        for process in processes:
            process.requests.hold()
        try:
            yield
        finally:
            for process in processes:
                process.requests.release()

    def leave(self) -> None:
        """Leave those alone that were not started here: another process coordinates them."""
        for process in self._all:
            process.leave()

    def limit_end(self) -> None:
        """Let the next requests be the last ones of the processes that were started here."""
        for process in self._all:
            process.requests.are_last = process.pid is not None

    def close(self) -> None:
        """Stop to observe the processes. Their loop has stopped."""
        for process in self._all:
            process.close()

    # --- what is requested of the system

    @property
    def are_known(self) -> bool:
        """Whether all have reported that were not started here, and none of their nodes moves."""
        return all(process.is_known for process in self._all)

    @property
    def is_running_unknown(self) -> bool:
        """Whether one certainly runs that has not reported yet, or whose nodes move."""
        return any(process.is_running and not process.is_known for process in self._all)

    @property
    def found_goals(self) -> SystemGoals | None:
        """What an earlier coordinating process has left; None if the system is to be started."""
        return self._goals.found

    def keep_goals(self, goals: Mapping[str, PrimaryState], activity: str) -> None:
        """Let all keep the goals of the system, by the keys of its nodes."""
        if self._processes:
            self._send(self._goals.change(goals, activity))

    def on_stop(self) -> None:
        """Ask for timings; let the next coordinating process start the system as the first one."""
        for process in self._all:
            self._loop.call_soon(process.ask_for_timings)
        self._send(self._goals.stop())

    def wait_for_messages(self, end_s: float) -> None:
        """Wait until the messages of :meth:`on_stop` are answered, or ``end_s`` (monotonic)."""
        if self._processes:
            with suppress(TimeoutError, RuntimeError):  # until the loop has prepared the messages
                self._loop.run(lambda: None, max(0.0, end_s - self._loop.clock.monotonic()))
        while any(process.requests.has_messages for process in self._all):
            if self._loop.clock.monotonic() > end_s:
                return
            self._loop.clock.sleep(_POLL_S)

    def callbacks(self) -> tuple[CallbackFigures, ...]:
        """Return the timings of callbacks that the processes have sent."""
        return tuple(item for process in self._all for item in process.timings.callbacks)

    def chains(self) -> tuple[ChainFigures, ...]:
        """Return the latencies of chains that the processes have sent."""
        return tuple(item for process in self._all for item in process.timings.chains)

    def _send(self, goals: SystemGoals | None) -> None:
        if goals is not None:
            for process in self._all:
                self._loop.call_soon(partial(process.keep_goals, goals))

    @property
    def _all(self) -> tuple[MemberProcess, ...]:
        return tuple(self._processes.values())
