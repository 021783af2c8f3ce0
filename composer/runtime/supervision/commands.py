"""What can be asked of a running system as a whole, as nav2's lifecycle manager has it.

``startup``   every node goes where a start takes it, as a whole or not at all; failures are history
``pause``     active nodes become inactive
``resume``    nodes that are inactive go where a start takes them, as a whole or not at all
``reset``     every node becomes unconfigured; failures are history
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
    """Carries commands out, on the main thread."""

    system: System
    node_set: NodeSet
    supervisor: Supervisor
    status: Status

    def carry_out(self, what: str) -> tuple[bool, str]:
        """Do it; return whether it went well, and how the system is now, or what went wrong."""
        doing, done = _ACTIVITIES[what]
        before = self.status.without_nodes.activity
        self.status.set_activity(doing)
        actions: dict[str, Callable[[], str | None]] = {
            "startup": self._start_up,
            "pause": self._pause,
            "resume": self._resume,
            "reset": self._reset,
        }
        problem = actions[what]()
        self.status.set_activity(done if problem is None else before)
        if problem is not None:
            return False, f"{problem}; {self.status.snapshot().summary}"
        return True, self.status.snapshot().summary

    def _start_up(self) -> str | None:
        problem = self._revive()
        return problem or self._bring_up(dict(self._start_goals()), forget=True)

    def _resume(self) -> str | None:
        states = self.node_set.states()
        goals = self._start_goals()
        inactive = [name for name, state in states.items() if state is PrimaryState.INACTIVE]
        return self._bring_up({name: goals[name] for name in inactive}, forget=False)

    def _pause(self) -> str | None:
        low = (PrimaryState.UNCONFIGURED, PrimaryState.INACTIVE)
        goals = self.supervisor.goals
        return self._lower(
            {name: goal if goal in low else PrimaryState.INACTIVE for name, goal in goals.items()},
            "the system is paused",
        )

    def _reset(self) -> str | None:
        goals = dict.fromkeys(self.node_set.nodes, PrimaryState.UNCONFIGURED)
        self.supervisor.want({}, forget=True)
        return self._lower(goals, "the system is reset") or self._revive()

    def _bring_up(self, goals: dict[str, PrimaryState], *, forget: bool) -> str | None:
        causes = start_causes(self.system, PrimaryState.ACTIVE)
        plan = plan_transitions(self.system, self.node_set.states(), goals, causes)
        problem = self.supervisor.bring_up(plan)
        if problem is not None:
            return f"{problem}; what this had started is where it was before"
        self.supervisor.want(goals, forget=forget)
        return self._unreached(goals)

    def _lower(self, goals: Mapping[str, PrimaryState], why: str) -> str | None:
        self.supervisor.want(goals)
        failures = self.supervisor.mend(why)
        if failures:
            step = failures[0].step
            return f"{step.full_name}: it did not {step.transition}: {failures[0].reason}"
        return None

    def _unreached(self, goals: Mapping[str, PrimaryState]) -> str | None:
        """Name a node that could not be asked: its executor hangs, or it is in mid-transition."""
        states = self.node_set.states()
        for name, goal in goals.items():
            if states.get(name) is not goal:
                node = self.node_set.nodes[name]
                return f"{node.full_name} is {node.state} and cannot be moved"
        return None

    def _start_goals(self) -> Mapping[str, PrimaryState]:
        return start_goals(self.system, PrimaryState.ACTIVE)

    def _revive(self) -> str | None:
        """Make finalized nodes anew; return what is in the way of that."""
        for name in self.node_set.nodes:
            try:
                self.node_set.revive(name)
            except CreationFailed as error:
                return f"{error.node}: {error}"
        return None
