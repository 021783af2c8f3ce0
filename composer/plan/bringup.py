"""Plan the bring-up and tear-down of a whole system."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from composer.model import Dependency, Node, PrimaryState, System
from composer.model.dependencies import DependencyEdge, dependency_edges, in_dependency_order
from composer.plan.steps import Phase, Plan, build_plan, downward, nodes_of, rank
from composer.plan.transitions import plan_transitions


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
