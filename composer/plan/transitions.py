"""Plan the transitions of nodes from any states to others: bring-up, tear-down, new goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.model import Dependency, Node, PrimaryState, System
from composer.model.dependencies import DependencyEdge, dependency_edges, in_dependency_order
from composer.plan.steps import Phase, Plan, build_plan, downward, nodes_of, rank, upward

#: A node, and the ranks of its state and of its goal.
_Movable: TypeAlias = tuple[Node, int, int]
_ACTIVE, _INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE


def plan_transitions(
    system: System,
    states: Mapping[str, PrimaryState],
    goals: Mapping[str, PrimaryState],
    causes: Mapping[str, str],
) -> Plan:
    """Return the plan that takes the nodes from ``states`` to ``goals``, in dependency order.

    First every transition down, in reverse order, then every transition up. A class is configured
    once the nodes that it depends on are active. ``causes`` gives the reason for each node. Nodes
    without a state or a goal are left alone.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, in_dependency_order(system))
    movable = tuple(
        (node, rank(states[node.name.value]), rank(goals[node.name.value]))
        for node in order
        if node.name.value in states and node.name.value in goals
    )
    reverse = tuple(reversed(movable))
    phases = [
        Phase(
            "deactivate",
            [node for node, state, goal in reverse if goal < rank(_ACTIVE) <= state],
            downward(edges, _ACTIVE),
        ),
        Phase(
            "cleanup",
            [node for node, state, goal in reverse if goal < rank(_INACTIVE) <= state],
            downward(edges, _INACTIVE),
        ),
    ]
    for wave in _waves(movable, edges):
        phases += (
            Phase(
                "configure",
                [node for node, state, goal in wave if state < rank(_INACTIVE) <= goal],
                upward(edges, _INACTIVE),
            ),
            Phase(
                "activate",
                [node for node, state, goal in wave if state < rank(_ACTIVE) <= goal],
                upward(edges, _ACTIVE),
            ),
        )
    return build_plan(phases, causes)


def _waves(movable: Sequence[_Movable], edges: Iterable[DependencyEdge]) -> list[list[_Movable]]:
    """Return the nodes that are configured, then activated together, in dependency order.

    A class does its work in its constructor, which may wait for messages and responses of the nodes
    that it depends on: these are active before.
    """
    needs: dict[str, list[DependencyEdge]] = {}
    for edge in edges:
        needs.setdefault(edge.node, []).append(edge)
    waves: list[list[_Movable]] = [[]]
    number: dict[str, int] = {}
    for item in movable:
        node = item[0]
        own = 0
        for edge in needs.get(node.name.value, ()):
            if edge.on in number:
                is_later = node.hosted_class is not None and edge.state is _ACTIVE
                own = max(own, number[edge.on] + is_later)
        number[node.name.value] = own
        waves += [[] for _ in range(own + 1 - len(waves))]
        waves[own].append(item)
    return waves


def bring_up(system: System, autostart: PrimaryState | None = None) -> Plan:
    """Return the plan that brings the system up from unconfigured.

    Every node goes as far as ``autostart`` (the system's own by default), but not beyond its own
    ``autostart``, nor beyond a dependency that stays below the state in which it is needed.
    """
    goal = system.autostart if autostart is None else autostart
    states = {node.name.value: PrimaryState.UNCONFIGURED for node in system.nodes}
    return plan_transitions(system, states, start_goals(system, goal), start_causes(system, goal))


def tear_down(system: System, process: str | None = None) -> Plan:
    """Return the plan that deactivates, cleans up and shuts down every node.

    With ``process``, those that this process of the system runs, in the order of the whole system.

    Each phase runs in reverse bring-up order. The plan assumes a system that is fully up; skip the
    steps that a node's current state does not allow.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, reversed(in_dependency_order(system)))
    if process is not None:
        order = tuple(node for node in order if node.process and node.process.value == process)
    return build_plan(
        (
            Phase("deactivate", order, downward(edges, PrimaryState.ACTIVE)),
            Phase("cleanup", order, downward(edges, PrimaryState.INACTIVE)),
            Phase("shutdown", order, downward(edges, PrimaryState.INACTIVE)),
        ),
        {node.name.value: "system is shutting down" for node in system.nodes},
    )


def start_goals(system: System, goal: PrimaryState) -> Mapping[str, PrimaryState]:
    """Return the state in which each node starts when the system as a whole goes to ``goal``."""
    goals: dict[str, PrimaryState] = {}
    for node in nodes_of(system, in_dependency_order(system)):
        limits = [_limit(dependency, goals) for dependency in node.depends_on]
        own = [] if node.autostart is None else [node.autostart.value]
        goals[node.name.value] = min([goal, *own, *limits], key=rank)
    return goals


def start_causes(system: System, goal: PrimaryState) -> Mapping[str, str]:
    """Return the reason for each node's place in the bring-up order."""
    edges = dependency_edges(system)
    declared = _dependents(edge for edge in edges if not edge.implied)
    implied = _dependents(edge for edge in edges if edge.implied)
    return {node.name.value: _cause(node, goal, declared, implied) for node in system.nodes}


def _cause(
    node: Node,
    goal: PrimaryState,
    declared: Mapping[str, tuple[str, ...]],
    implied: Mapping[str, tuple[str, ...]],
) -> str:
    name = node.name.value
    if name in declared:
        users = declared[name]
        return f"{_listing(users)} {'depends' if len(users) == 1 else 'depend'} on it"
    if name in implied:
        users = implied[name]
        verb = "calls" if len(users) == 1 else "call"
        return f"{_listing(users)} {verb} it, and servers start before their clients"
    if node.autostart is not None and rank(node.autostart.value) < rank(goal):
        return f"its own autostart is {node.autostart.value}"
    return f"system autostart is {goal}"


def _limit(dependency: Dependency, goals: Mapping[str, PrimaryState]) -> PrimaryState:
    """Return the highest state that a dependency allows its node."""
    reached = goals.get(dependency.node.value, dependency.state)
    return PrimaryState.ACTIVE if rank(reached) >= rank(dependency.state) else reached


def _dependents(edges: Iterable[DependencyEdge]) -> dict[str, tuple[str, ...]]:
    """Return the names of the nodes that wait for each node."""
    users: dict[str, dict[str, None]] = {}
    for edge in edges:
        users.setdefault(edge.on, {})[edge.node] = None
    return {name: tuple(waiting) for name, waiting in users.items()}


def _listing(names: tuple[str, ...]) -> str:
    """Return one or two names, or the first name and the number of others."""
    if len(names) <= 2:
        return " and ".join(names)
    return f"{names[0]} and {len(names) - 1} others"


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

    def states(self, system: System) -> Mapping[str, PrimaryState]:
        """Return the goal of each node of the system, by its key."""
        names = {node.name.value: node.full_name for node in system.nodes}
        goals = start_goals(system, self.limit)
        return {name: self.others.get(names[name], goal) for name, goal in goals.items()}


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
