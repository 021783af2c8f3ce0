"""Starts a system, or takes it over from an earlier coordinating process."""

from __future__ import annotations

import time
from collections.abc import Callable

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, PrimaryState, System
from composer.model.names import PROGRAM_LOGGER
from composer.plan import Plan, SystemGoals, optional_nodes
from composer.runtime.supervision.events import BroughtUp, Reporter
from composer.runtime.supervision.main_queue import Command, Item, MainQueue
from composer.runtime.supervision.node_set import NodeSet
from composer.runtime.supervision.status import Status
from composer.runtime.supervision.supervisor import Supervisor

#: Processes report every second. Bring-up waits longer for those that are started only now.
_REPORTS_WITHIN_S = 5.0
#: A process that certainly runs is discovered and reports within this time, on a busy machine.
_RUNNING_REPORT_WITHIN_S = 30.0
_POLL_S = 0.02


@dataclass(frozen=True, slots=True)
class SystemStart:
    """Leads the nodes of a system to their first goals.

    ``up`` is the plan of a start. With ``all_or_nothing``, the first failure of a required node
    ends it; otherwise, the policies of the nodes apply. ``run_command`` runs the commands that come
    before the end of the bring-up.
    """

    system: System
    up: Plan
    node_set: NodeSet
    supervisor: Supervisor
    main_queue: MainQueue[Item]
    reporter: Reporter
    status: Status
    run_command: Callable[[Command], None]
    all_or_nothing: bool

    def run(self, within_s: float) -> str | None:
        """Bring the system up within a time, or take it over; return why that failed, or None."""
        self._wait_for_processes(within_s)
        found = self.node_set.other_processes.found_goals
        problem = None
        if found is None:
            problem = self._bring_up(within_s)
        else:
            self._take_over(found)
        if problem is None and not self.main_queue.stopping:
            status = self.status.snapshot()
            self.reporter.report(
                BroughtUp(
                    self.reporter.elapsed_s,
                    self.node_set.active(),
                    len(self.node_set.nodes),
                    status.remarks,
                    is_complete=not status.failed,
                )
            )
        return problem

    def _wait_for_processes(self, within_s: float) -> None:
        """Wait until other processes that run already have reported."""
        processes, queue = self.node_set.other_processes, self.main_queue
        start_s = time.monotonic()
        while not processes.are_known and not queue.stopping:
            is_certain = processes.is_running_unknown
            limit_s = _RUNNING_REPORT_WITHIN_S if is_certain else _REPORTS_WITHIN_S
            if time.monotonic() >= start_s + min(limit_s, within_s):
                return
            queue.wait(lambda: False, time.monotonic() + _POLL_S, stoppable=True)

    def _bring_up(self, within_s: float) -> str | None:
        serial = self.supervisor.desired.serial
        names = (node.name.value for node in self.system.nodes)
        goals = self.up.states_after(dict.fromkeys(names, PrimaryState.UNCONFIGURED))
        if self.all_or_nothing:
            optional = optional_nodes(self.system)
            needed = Plan(tuple(step for step in self.up.steps if step.node not in optional))
            failed = self.supervisor.bring_up_together(needed, serial, within_s)
            if failed is not None:
                return f"{failed.partition(':')[0]} failed"
        problem = self.supervisor.bring_up(goals, self.run_command, serial, within_s)
        if self.status.without_nodes.activity == "starting":
            self.status.set_activity("running")
        return problem

    def _take_over(self, found: SystemGoals) -> None:
        """Lead the nodes to the goals that they had: those that are there do not move."""
        text = f"an earlier process has coordinated the system, which is {found.activity}"
        self.reporter.log(LogLevel.INFO, PROGRAM_LOGGER, text)
        serial = self.supervisor.desired.serial
        self.node_set.take_over()
        self.supervisor.start(found.states(self.system), found.activity, serial)
        self.supervisor.reconcile_settled("goal under the earlier coordinating process")
