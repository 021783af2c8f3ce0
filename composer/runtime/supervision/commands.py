"""Commands for a running system as a whole, as in nav2's lifecycle manager.

``startup``   bring up all nodes, all or nothing, and forget failures
``pause``     deactivate the active nodes
``resume``    bring up the inactive nodes, all or nothing
``reset``     make all nodes unconfigured, and forget failures
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from composer.model import PrimaryState, System
from composer.plan import plan_transitions, start_causes, start_goals
from composer.runtime.supervision.node_set import CreationFailed, NodeSet
from composer.runtime.supervision.status import Status
from composer.runtime.supervision.supervisor import Supervisor

_ACTIVITIES = {
    "startup": ("starting", "running"),
    "pause": ("pausing", "paused"),
    "resume": ("resuming", "running"),
    "reset": ("resetting", "reset"),
}


@dataclass(frozen=True, slots=True)
class Commands:
    """Runs commands, on the main thread."""

    system: System
    node_set: NodeSet
    supervisor: Supervisor
    status: Status

    def run(self, name: str) -> tuple[bool, str]:
        """Run a command; return whether it succeeded, and the problem and state of the system."""
        doing, done = _ACTIVITIES[name]
        before = self.status.without_nodes.activity
        self.status.set_activity(doing)
        actions: dict[str, Callable[[], str | None]] = {
            "startup": self._start_up,
            "pause": self._pause,
            "resume": self._resume,
            "reset": self._reset,
        }
        problem = actions[name]()
        self.status.set_activity(done if problem is None else before)
        if problem is not None:
            return False, f"{problem}; {self.status.snapshot().summary}"
        return True, self.status.snapshot().summary

    def _start_up(self) -> str | None:
        problem = self._recreate()
        return problem or self._bring_up(dict(self._start_goals()), forget_failures=True)

    def _resume(self) -> str | None:
        states = self.node_set.states()
        goals = self._start_goals()
        inactive = [name for name, state in states.items() if state is PrimaryState.INACTIVE]
        return self._bring_up({name: goals[name] for name in inactive})

    def _pause(self) -> str | None:
        low = (PrimaryState.UNCONFIGURED, PrimaryState.INACTIVE)
        goals = self.supervisor.goals
        return self._lower(
            {name: goal if goal in low else PrimaryState.INACTIVE for name, goal in goals.items()},
            "the system is paused",
        )

    def _reset(self) -> str | None:
        goals = dict.fromkeys(self.node_set.nodes, PrimaryState.UNCONFIGURED)
        self.supervisor.set_goals({}, forget_failures=True)
        return self._lower(goals, "the system is reset") or self._recreate()

    def _bring_up(
        self, goals: dict[str, PrimaryState], *, forget_failures: bool = False
    ) -> str | None:
        causes = start_causes(self.system, PrimaryState.ACTIVE)
        plan = plan_transitions(self.system, self.node_set.states(), goals, causes)
        problem = self.supervisor.bring_up(plan)
        if problem is not None:
            return f"{problem}; rolled back"
        self.supervisor.set_goals(goals, forget_failures=forget_failures)
        return self._unreached(goals)

    def _lower(self, goals: Mapping[str, PrimaryState], cause: str) -> str | None:
        self.supervisor.set_goals(goals)
        failures = self.supervisor.reconcile(cause)
        return str(failures[0]) if failures else None

    def _unreached(self, goals: Mapping[str, PrimaryState]) -> str | None:
        """Name a node that could not be moved: its executor hangs, or a transition runs."""
        states = self.node_set.states()
        for name, goal in goals.items():
            if states.get(name) is not goal:
                node = self.node_set.nodes[name]
                return f"{node.full_name} is {node.state} and cannot be moved"
        return None

    def _start_goals(self) -> Mapping[str, PrimaryState]:
        return start_goals(self.system, PrimaryState.ACTIVE)

    def _recreate(self) -> str | None:
        """Create finalized nodes again; return why one cannot be created."""
        for name in self.node_set.nodes:
            try:
                self.node_set.recreate(name)
            except CreationFailed as error:
                return f"{error.node}: {error}"
        return None
