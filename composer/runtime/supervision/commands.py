"""Runs commands for the whole system, as nav2's lifecycle manager does.

``startup``   bring up all nodes, and forget failures
``pause``     deactivate the active nodes
``resume``    bring up the inactive nodes
``reset``     make all nodes unconfigured, and forget failures
``restart``   take nodes down and bring them up again, each to its desired state

Failures are handled by the policies of the nodes, unless a command is all or nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial

from composer.base.fast_dataclass import dataclass
from composer.model import PrimaryState
from composer.plan import (
    blocked_nodes,
    optional_nodes,
    plan_transitions,
    start_causes,
    start_goals,
)
from composer.runtime.supervision.main_queue import DOWN, Command, SupervisionContext
from composer.runtime.supervision.supervisor import Supervisor

_ACTIVITIES = {
    "startup": ("starting", "running"),
    "pause": ("pausing", "paused"),
    "resume": ("resuming", "running"),
    "reset": ("resetting", "reset"),
}
_RESTART = "restart"


@dataclass(frozen=True, slots=True)
class Commands:
    """Runs commands, on the main thread."""

    context: SupervisionContext
    supervisor: Supervisor

    def run(self, command: Command) -> tuple[bool, str]:
        """Run a command; return whether it succeeded, and the problem and state of the system."""
        if command.name == _RESTART:
            problem = self._restart(command.nodes, self.supervisor.desired.serial)
        else:
            problem = self._run_for_system(command.name, together=command.all_or_nothing)
        summary = self.context.status.snapshot().message
        return problem is None, summary if problem is None else f"{problem}; {summary}"

    def _run_for_system(self, name: str, *, together: bool) -> str | None:
        doing, done = _ACTIVITIES[name]
        before = self.context.status.without_nodes.activity
        self.context.status.set_activity(doing)
        actions: dict[str, Callable[[int], str | None]] = {
            "startup": partial(self._start_up, together=together),
            "pause": self._pause,
            "resume": partial(self._resume, together=together),
            "reset": self._reset,
        }
        problem = actions[name](self.supervisor.desired.serial)
        self.context.status.set_activity(done if problem is None else before)
        return problem

    # The actions move no node that has been moved on request since the serial number ``since``.

    def _start_up(self, since: int, *, together: bool) -> str | None:
        problem = self._recreate(since)
        if problem is not None:
            return problem
        names = self._start_goals().keys()
        return self._bring_up(names, since, together=together, forget_failures=True)

    def _resume(self, since: int, *, together: bool) -> str | None:
        """Nodes that depend on a failed one come up after it."""
        states = self.context.node_set.states()
        inactive = {name for name, at in states.items() if at is PrimaryState.INACTIVE}
        return self._bring_up(inactive, since, together=together)

    def _pause(self, since: int) -> str | None:
        low = (PrimaryState.UNCONFIGURED, PrimaryState.INACTIVE)
        goals = {
            name: goal if goal in low else PrimaryState.INACTIVE
            for name, goal in self.supervisor.desired.goals.items()
        }
        return self._lower(goals, since, "the system is paused", "paused")

    def _reset(self, since: int) -> str | None:
        goals = dict.fromkeys(self.context.node_set.nodes, PrimaryState.UNCONFIGURED)
        problem = self._lower(goals, since, "the system is reset", "reset", forget_failures=True)
        return problem or self._recreate(since)

    def _restart(self, full_names: Collection[str], since: int) -> str | None:
        """Restart nodes, with the nodes that depend on them inactive meanwhile.

        A node that was shut down, or not brought up, is started.
        """
        names = [
            name
            for name, node in self.context.node_set.nodes.items()
            if node.full_name in full_names
        ]
        for name in names:
            if self.context.node_set.is_lost(name):
                return f"{self.context.full_name(name)} hangs and cannot be restarted"
        for failure in self.supervisor.take_down(names, "restart requested"):
            name = failure.step.node
            if name in names and self.context.node_set.nodes[name].state not in DOWN:
                return str(failure)
        goals = self._start_goals()
        started = {
            name: goals[name]
            for name in names
            if self.supervisor.desired.goals[name] is PrimaryState.UNCONFIGURED
        }
        self.supervisor.release(names)
        self.supervisor.set_goals(started, since)
        problem = self._recreate(since, names)
        if problem is None:
            failures = self.supervisor.reconciler.reconcile("restart requested")
            problem = str(failures[0]) if failures else None
        return problem or self._unreached_of(names)

    def _bring_up(
        self,
        names: Collection[str],
        since: int,
        *,
        together: bool,
        forget_failures: bool = False,
    ) -> str | None:
        """Bring nodes up; with ``together``, undo it if one fails that the system needs."""
        start_goals = self._start_goals()
        goals = {name: start_goals[name] for name in names}
        left = {*optional_nodes(self.context.system)}
        if not forget_failures:
            left |= blocked_nodes(self.context.system, self.supervisor.desired).keys()
        needed = {name: goal for name, goal in goals.items() if name not in left}
        if together:
            causes = start_causes(self.context.system, PrimaryState.ACTIVE)
            plan = plan_transitions(
                self.context.system, self.context.node_set.states(), needed, causes
            )
            problem = self.supervisor.bring_up_together(plan, since)
            if problem is not None:
                return f"{problem}; rolled back"
        self.supervisor.set_goals(goals, since, "running", forget_failures=forget_failures)
        self.supervisor.reconciler.reconcile_settled("bring-up requested")
        self.supervisor.settle()
        desired = self.supervisor.desired
        failed = [self.context.full_name(name) for name in needed if name in desired.down]
        if failed:
            return f"{', '.join(failed)} failed"
        blocked = {*blocked_nodes(self.context.system, desired), *desired.ignored}
        return self._unreached({name: needed[name] for name in needed if name not in blocked})

    def _lower(
        self,
        goals: Mapping[str, PrimaryState],
        since: int,
        cause: str,
        activity: str,
        *,
        forget_failures: bool = False,
    ) -> str | None:
        self.supervisor.set_goals(goals, since, activity, forget_failures=forget_failures)
        failures = self.supervisor.reconciler.reconcile(cause)
        return str(failures[0]) if failures else None

    def _unreached(self, goals: Mapping[str, PrimaryState]) -> str | None:
        """Name a node that could not be moved: its executor hangs, or a transition runs."""
        states = self.context.node_set.states()
        for name, goal in goals.items():
            if states.get(name) is not goal:
                node = self.context.node_set.nodes[name]
                return f"{node.full_name} is {node.state} and cannot be moved"
        return None

    def _unreached_of(self, names: Collection[str]) -> str | None:
        """Name a restarted node that has not reached its goal, as one it depends on is down."""
        desired = self.supervisor.desired
        blocked = blocked_nodes(self.context.system, desired)
        return self._unreached({name: desired.goals[name] for name in names if name not in blocked})

    def _start_goals(self) -> Mapping[str, PrimaryState]:
        return start_goals(self.context.system, PrimaryState.ACTIVE)

    def _recreate(self, since: int, names: Collection[str] | None = None) -> str | None:
        """Create finalized nodes again, by default all; return why one cannot be created."""
        for name, node in tuple(self.context.node_set.nodes.items()):
            if names is not None and name not in names:
                continue
            problem = self.context.node_set.recreate(
                name, partial(self.supervisor.has_moved, name, since)
            )
            self.context.status.update_states({name: self.context.node_set.nodes[name].state})
            if problem is not None:
                return f"{node.full_name}: {problem}"
        return None
