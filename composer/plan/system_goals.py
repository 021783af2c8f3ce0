"""What is requested of a system: kept by its other processes, for the next coordinating one.

The states of nodes do not say whether a pause, a user or an interrupted bring-up has left them
inactive. The goals do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.model import PrimaryState, System
from composer.plan.bringup import start_goals

STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class SystemGoals:
    """The goals of all nodes: those of a start up to the state ``limit``, except ``others``.

    ``others`` are goals by the full names of nodes. ``serial`` increases with each change, also
    over several coordinating processes. ``activity`` is that of the system, for example "paused";
    once the coordinating process has shut the system down in order, it is "stopped".
    """

    serial: int
    activity: str
    limit: PrimaryState = PrimaryState.ACTIVE
    others: Mapping[str, PrimaryState] = field(default_factory=dict)

    def __str__(self) -> str:
        others = (f"{name}={state}" for name, state in self.others.items())
        return " ".join((str(self.serial), self.activity, self.limit, *others))

    def states(self, system: System) -> Mapping[str, PrimaryState]:
        """Return the goal of each node of the system, by its key."""
        names = {node.name.value: node.full_name for node in system.nodes}
        goals = start_goals(system, self.limit)
        return {name: self.others.get(names[name], goal) for name, goal in goals.items()}


def parse_goals(text: str) -> SystemGoals | None:
    """Return the goals in a text; None if it has none, or those of another version."""
    try:
        serial, activity, limit, *others = text.split()
        pairs = (item.split("=") for item in others)
        states = {name: PrimaryState(state) for name, state in pairs}
        return SystemGoals(int(serial), activity, PrimaryState(limit), states)
    except ValueError:
        return None


def system_goals(
    system: System, goals: Mapping[str, PrimaryState], activity: str, serial: int
) -> SystemGoals:
    """Return the goals of nodes, given by their keys, with as few ``others`` as possible."""
    found = (_up_to(limit, system, goals, activity, serial) for limit in reversed(PrimaryState))
    return min(found, key=lambda candidate: len(candidate.others))


def _up_to(
    limit: PrimaryState,
    system: System,
    goals: Mapping[str, PrimaryState],
    activity: str,
    serial: int,
) -> SystemGoals:
    usual = start_goals(system, limit)
    others = {
        node.full_name: goals[node.name.value]
        for node in system.nodes
        if goals.get(node.name.value, usual[node.name.value]) is not usual[node.name.value]
    }
    return SystemGoals(serial, activity, limit, others)
