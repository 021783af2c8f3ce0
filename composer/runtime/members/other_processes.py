"""The other processes of the system together, and the goals that are kept while there are any."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager

from composer.model import PrimaryState, System
from composer.runtime.callbacks.log import Write
from composer.runtime.members.kept_goals import KeptGoals
from composer.runtime.members.lives import MemberContext
from composer.runtime.members.process import MemberProcess
from composer.runtime.outside_nodes.outside_node import OutsideContext
from composer.runtime.process.computer import is_this_computer
from composer.runtime.process.instance_lock import goals_path
from composer.runtime.protocol.reports import SystemReport


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
        #: The goals of the system, for the next coordinating process.
        self.goals = KeptGoals(system, goals_path(namespace) if self._models else None)
        self._processes: dict[str, MemberProcess] = {}

    def process(self, name: str, context: OutsideContext) -> MemberProcess:
        """Return a process, for the first of its nodes a new one. All have the same loop."""
        if name not in self._processes:
            model = self._models[name]
            host = None if model.host is None else model.host.value
            is_local = host is None or is_this_computer(self._addresses[host])
            self._processes[name] = MemberProcess(
                model,
                MemberContext(
                    loop=context.loop,
                    manager=context.manager,
                    children=context.children,
                    namespace=self._namespace,
                    command=self._command if is_local else (),
                    write_log=self._write_log,
                    together=self._together,
                    run_state=context.run_state,
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

    def close(self) -> None:
        """Stop to observe the processes. Their loop has stopped."""
        for process in self._all:
            process.close()

    @property
    def are_known(self) -> bool:
        """Whether all have reported that were not started here, and none of their nodes moves."""
        return all(process.is_known for process in self._all)

    @property
    def is_running_unknown(self) -> bool:
        """Whether one certainly runs that has not reported yet, or whose nodes move."""
        return any(process.is_running and not process.is_known for process in self._all)

    @property
    def last_reports(self) -> tuple[SystemReport, ...]:
        """The last reports of the processes."""
        return tuple(item for process in self._all if (item := process.last_report) is not None)

    def found_goals(self) -> tuple[Mapping[str, PrimaryState], str] | None:
        """Return what an earlier coordinating process has left, by the keys of nodes.

        None if it has left no nodes inactive or active: then the system is to be started.
        """
        has_kept_nodes = any(process.has_kept_nodes for process in self._all)
        return self.goals.read() if has_kept_nodes else None

    @property
    def _all(self) -> tuple[MemberProcess, ...]:
        return tuple(self._processes.values())
