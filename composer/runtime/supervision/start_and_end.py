"""How a system begins, and how it ends.

A start brings the nodes up, or takes over those that an earlier coordinating process has left. The
end tears them down, within the limits of time of :class:`.HostOptions`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass
from composer.model import LogLevel, PrimaryState
from composer.model.names import PROGRAM_LOGGER
from composer.plan import Fault, Plan, optional_nodes, start_goals
from composer.runtime.metrics.figures import merged_chains
from composer.runtime.process.libraries import leave_ros_graph, supports_fast_exit
from composer.runtime.supervision.events import (
    BroughtUp,
    NodeSummary,
    Outcome,
    Stopping,
)
from composer.runtime.supervision.main_queue import Command, SupervisionContext
from composer.runtime.supervision.supervisor import Supervisor

if TYPE_CHECKING:
    from composer.runtime.host_options import HostOptions

#: Processes report every second. Bring-up waits longer for those that are started only now.
STARTED_REPORT_WITHIN_S = 5.0
#: A process that certainly runs is discovered and reports within this time, on a busy machine.
_RUNNING_REPORT_WITHIN_S = 30.0
_POLL_S = 0.02
#: The longest share of the time for the tear-down that one step may take.
_STEP_SHARE = 0.7
_URGENT_S = 0.2
#: This many nodes can be destroyed one by one within half a second.
_FEW_NODES = 20


@dataclass(frozen=True, slots=True)
class SystemStart:
    """Leads the nodes of a system to their first goals.

    ``up`` is the plan of a start. With ``all_or_nothing``, the first failure of a required node
    ends it; otherwise, the policies of the nodes apply. ``run_command`` runs the commands that come
    before the end of the bring-up.
    """

    context: SupervisionContext
    supervisor: Supervisor
    up: Plan
    run_command: Callable[[Command], None]
    all_or_nothing: bool

    def run(self, within_s: float) -> str | None:
        """Bring the system up within a time, or take it over; return why that failed, or None."""
        self._wait_for_processes(within_s)
        found = self.context.node_set.other_processes.found_goals()
        problem = None
        if found is None:
            problem = self._bring_up(within_s)
        else:
            self._take_over(*found)
        if problem is None and not self.context.main_queue.stopping:
            status = self.context.status.snapshot()
            missing = status.missing_nodes(reasons=False)
            is_complete = not status.failed
            details = status.active, len(status.nodes), status.remarks, is_complete, missing
            self.context.reporter.report(BroughtUp, *details)
        return problem

    def _wait_for_processes(self, within_s: float) -> None:
        """Wait until other processes that run already have reported."""
        processes, queue = self.context.node_set.other_processes, self.context.main_queue
        start_s = queue.clock.monotonic()
        while not processes.are_known and not queue.stopping:
            is_certain = processes.is_running_unknown
            limit_s = _RUNNING_REPORT_WITHIN_S if is_certain else STARTED_REPORT_WITHIN_S
            if queue.clock.monotonic() >= start_s + min(limit_s, within_s):
                return
            queue.wait(lambda: False, queue.clock.monotonic() + _POLL_S, stoppable=True)

    def _bring_up(self, within_s: float) -> str | None:
        serial = self.supervisor.desired.serial
        names = (node.name.value for node in self.context.system.nodes)
        goals = self.up.states_after(dict.fromkeys(names, PrimaryState.UNCONFIGURED))
        if self.all_or_nothing:
            optional = optional_nodes(self.context.system)
            needed = Plan(tuple(step for step in self.up.steps if step.node not in optional))
            failed = self.supervisor.bring_up_together(needed, serial, within_s)
            if failed is not None:
                return f"{failed.partition(':')[0]} failed"
        problem = self.supervisor.bring_up(goals, self.run_command, serial, within_s)
        if self.context.status.without_nodes.activity == "starting":
            self.context.status.set_activity("running")
        return problem

    def _take_over(self, found: Mapping[str, PrimaryState], activity: str) -> None:
        """Lead the nodes to the goals that they had: those that are there do not move."""
        text = f"an earlier process has coordinated the system, which is {activity}"
        self.context.reporter.log(LogLevel.INFO, PROGRAM_LOGGER, text)
        serial = self.supervisor.desired.serial
        self.context.node_set.take_over()
        goals = {**start_goals(self.context.system, PrimaryState.ACTIVE), **found}
        self.supervisor.set_goals(goals, serial, activity)
        self.context.status.set_activity(activity)
        self.supervisor.reconciler.reconcile_settled("goal under the earlier coordinating process")


class SystemEnd:
    """Tears the nodes of a system down and destroys them."""

    def __init__(self, down: Plan, supervisor: Supervisor, options: HostOptions) -> None:
        self._down = down
        self._supervisor = supervisor
        self._context = supervisor.context
        self._options = options
        self._summary: tuple[NodeSummary, ...] = ()
        self._remarks: tuple[str, ...] = ()
        self._end_s = math.inf
        self._is_left_to_exit = False  # only the end of the process removes all nodes
        #: Whether the run has failed, which it may have before its end.
        self.has_failed = False
        #: Whether the end of the process removes the nodes faster than their destruction.
        self.uses_fast_exit = options.ends_process and len(self._context.system.nodes) > _FEW_NODES
        self.has_left_graph = False

    def keep_entities(self) -> None:
        """Leave the entities of the nodes to the end of the process, if that is faster."""
        if self.uses_fast_exit and supports_fast_exit():
            self._context.node_set.run_state.keeps_entities = True

    def tear_down(self, *, is_created: bool) -> None:
        """Lead the nodes down, if all of them were created."""
        if not self._context.main_queue.stopping:
            self._context.main_queue.request_stop("unrecoverable error")
        self.has_failed = self.has_failed or self._supervisor.has_failed_nodes
        self._context.status.set_activity("stopping")
        remarks = self._context.status.snapshot().remarks
        # The reason begins with the node that has ended the system, if one has.
        ended_by = self._reason.partition(" ")[0]
        self._remarks = tuple(text for text in remarks if not text.startswith(f"{ended_by} is "))
        self._context.reporter.report(Stopping, self._reason)
        self.keep_entities()
        stop_within_s = self._options.stop_within_s
        self._end_s = self._context.clock.monotonic() + stop_within_s
        self._context.node_set.run_state.end_s = self._end_s
        self._context.node_set.other_processes.goals.forget()
        if is_created:
            limit_s = _STEP_SHARE * stop_within_s
            if not self._supervisor.tear_down(self._down, self._end_s, limit_s):
                self.has_failed = True
        self._summary = self._context.node_set.summaries()
        if self._options.fail_on_error and any(node.errors for node in self._summary):
            self.has_failed = True

    def destroy(self, shutdown_commands: Iterable[Command]) -> None:
        """Answer the remaining commands and destroy the nodes, as far as there is time."""
        for item in (*shutdown_commands, *self._context.main_queue.drain()):
            if isinstance(item, Command):
                message = f"the system has stopped: {self._reason}"
                item.answer(item.name == "shutdown", message)
            elif isinstance(item, Fault):
                self.has_failed = True  # it was not handled
        self._context.status.set_activity("stopped")
        end_s = self._end_s
        if self._context.main_queue.urgent:
            end_s = min(end_s, self._context.clock.monotonic() + _URGENT_S)
        self._context.node_set.stop_loops(end_s)
        self._is_left_to_exit = not self._context.node_set.destroy(end_s)
        self.has_failed = self.has_failed or self._context.node_set.has_unfinished()

    def leave_graph(self) -> bool:
        """Leave the ROS graph without destroying what is left of the nodes, if that is possible.

        Return whether the process has left it.
        """
        # A hung thread may run again and use what the fast exit has destroyed.
        if self._is_left_to_exit and self._options.ends_process and not self._context.node_set.hung:
            self.has_left_graph = leave_ros_graph()
        return self.has_left_graph

    def outcome(self) -> Outcome:
        """Return how the run went."""
        others = self._context.node_set.other_processes.last_reports
        of_others = (item for report in others for item in report.callbacks)
        chains = (item for report in others for item in report.chains)
        return Outcome(
            exit_code=1 if self.has_failed else 0,
            reason=self._reason,
            elapsed_s=self._context.reporter.elapsed_s,
            nodes=self._summary,
            hung=self._is_left_to_exit,
            remarks=self._remarks,
            callbacks=(*self._context.node_set.callbacks(), *of_others),
            chains=merged_chains(self._context.node_set.chains(), chains),
        )

    @property
    def _reason(self) -> str:
        return self._context.main_queue.stop_reason or ""
