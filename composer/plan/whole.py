"""A whole system's way up and down."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from composer.model import Dependency, Node, PrimaryState, System
from composer.model.dependencies import Edge, dependency_edges, in_dependency_order
from composer.plan.reach import reach
from composer.plan.steps import Phase, Plan, downward, nodes_of, plan_of, rank


def bring_up(system: System, autostart: PrimaryState | None = None) -> Plan:
    """Return how the system gets from unconfigured to where it is to start.

    Every node goes as far as ``autostart`` says (the system's own, unless given), but no further
    than its own ``autostart`` and than a node it depends on that stays below the state it needs.
    """
    goal = system.autostart if autostart is None else autostart
    states = {node.name.value: PrimaryState.UNCONFIGURED for node in system.nodes}
    return reach(system, states, start_goals(system, goal), start_causes(system, goal))


def tear_down(system: System) -> Plan:
    """Return how the system ends: every node deactivated, then cleaned up, then shut down.

    Each phase runs in the reverse of the bring-up's order. The plan is for a system that is fully
    up; a step that a node's state at the time does not allow has nothing left to do.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, reversed(in_dependency_order(system, edges)))
    return plan_of(
        (
            Phase("deactivate", order, downward(edges, PrimaryState.ACTIVE)),
            Phase("cleanup", order, downward(edges, PrimaryState.INACTIVE)),
            Phase("shutdown", order, downward(edges, PrimaryState.INACTIVE)),
        ),
        {node.name.value: "system is going down" for node in system.nodes},
    )


def start_goals(system: System, goal: PrimaryState) -> Mapping[str, PrimaryState]:
    """Return where each node is to start when the system as a whole is to reach ``goal``."""
    goals: dict[str, PrimaryState] = {}
    edges = dependency_edges(system)
    for node in nodes_of(system, in_dependency_order(system, edges)):
        limits = [_limit(dependency, goals) for dependency in node.depends_on]
        own = [] if node.autostart is None else [node.autostart.value]
        goals[node.name.value] = min([goal, *own, *limits], key=rank)
    return goals


def start_causes(system: System, goal: PrimaryState) -> Mapping[str, str]:
    """Return why each node is started where it is in the order."""
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
        return f"{_listed(users)} {'depends' if len(users) == 1 else 'depend'} on it"
    if name in implied:
        users = implied[name]
        verb = "calls" if len(users) == 1 else "call"
        return f"{_listed(users)} {verb} it, and servers start before their clients"
    if node.autostart is not None and rank(node.autostart.value) < rank(goal):
        return f"its own autostart is {node.autostart.value}"
    return f"system autostart is {goal}"


def _limit(dependency: Dependency, goals: Mapping[str, PrimaryState]) -> PrimaryState:
    """Return how far a node may go: as far as what it depends on, if that stays too low for it."""
    reached = goals.get(dependency.node.value, dependency.state)
    return PrimaryState.ACTIVE if rank(reached) >= rank(dependency.state) else reached


def _dependents(edges: Iterable[Edge]) -> dict[str, tuple[str, ...]]:
    """Return for every node that others wait for, who they are."""
    users: dict[str, dict[str, None]] = {}
    for edge in edges:
        users.setdefault(edge.on, {})[edge.node] = None
    return {name: tuple(waiting) for name, waiting in users.items()}


def _listed(names: tuple[str, ...]) -> str:
    """Return one or two names, or the first one and how many more."""
    if len(names) <= 2:
        return " and ".join(names)
    return f"{names[0]} and {len(names) - 1} others"
