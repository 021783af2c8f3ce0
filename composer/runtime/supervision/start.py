"""Starts a system, or takes it over from an earlier coordinating process."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

from composer.model import LogLevel, PrimaryState, System
from composer.names import PROGRAM_LOGGER
from composer.plan import Plan, SystemGoals
from composer.runtime.supervision.events import BroughtUp, Reporter
from composer.runtime.supervision.main_queue import Item, MainQueue
from composer.runtime.supervision.node_set import NodeSet
from composer.runtime.supervision.supervisor import Supervisor

#: Processes report every second. Bring-up waits longer for those that are started only now.
_REPORTS_WITHIN_S = 5.0
#: A process that certainly runs is discovered and reports within this time, on a busy machine.
_RUNNING_REPORT_WITHIN_S = 30.0
_POLL_S = 0.02


@dataclass(frozen=True, slots=True)
class SystemStart:
    """Leads the nodes of a system to their first goals. ``up`` is the plan of a start."""

    system: System
    up: Plan
    node_set: NodeSet
    supervisor: Supervisor
    main_queue: MainQueue[Item]
    reporter: Reporter

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
            self.reporter.report(
                BroughtUp(self.reporter.elapsed_s, self.node_set.active(), len(self.node_set.nodes))
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
        failed = self.supervisor.bring_up(self.up, serial, within_s)
        if failed is not None:
            return f"{failed.partition(':')[0]} failed"
        if not self.main_queue.stopping:
            self.supervisor.start(self._reached(), "running", serial)
        return None

    def _reached(self) -> Mapping[str, PrimaryState]:
        """Return the states that the bring-up has reached, also of nodes that have failed since."""
        states = self.node_set.states()
        planned = self.up.states_after(states)
        failed = self.supervisor.desired.unhandled.keys() & planned.keys()
        return {**states, **{name: planned[name] for name in failed}}

    def _take_over(self, found: SystemGoals) -> None:
        """Lead the nodes to the goals that they had: those that are there do not move."""
        text = f"an earlier process has coordinated the system, which is {found.activity}"
        self.reporter.log(LogLevel.INFO, PROGRAM_LOGGER, text)
        serial = self.supervisor.desired.serial
        self.node_set.take_over()
        self.supervisor.start(found.states(self.system), found.activity, serial)
        self.supervisor.reconcile_settled("goal under the earlier coordinating process")
