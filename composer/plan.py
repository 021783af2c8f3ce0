"""What is done to bring a system up and down: steps in order, each with its cause.

A plan is data. It decides everything and does nothing; the runtime does it and decides nothing
(DESIGN: The way data flows). Nodes are configured and then activated behind the nodes they depend
on, and taken down in reverse. What waits for what is told by :mod:`composer.model.dependencies`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from composer.model import Dependency, Node, PrimaryState, System
from composer.model.dependencies import Edge, dependency_edges, in_dependency_order

TransitionName: TypeAlias = Literal["configure", "activate", "deactivate", "cleanup", "shutdown"]

_RANK = {PrimaryState.UNCONFIGURED: 0, PrimaryState.INACTIVE: 1, PrimaryState.ACTIVE: 2}
_UPWARD: tuple[tuple[TransitionName, PrimaryState], ...] = (
    ("configure", PrimaryState.INACTIVE),
    ("activate", PrimaryState.ACTIVE),
)
_DOWNWARD: tuple[TransitionName, ...] = ("deactivate", "cleanup", "shutdown")


@dataclass(frozen=True, slots=True)
class Step:
    """One transition of one node. ``number`` counts from 1; ``node`` is its key in the system."""

    number: int
    transition: TransitionName
    node: str
    full_name: str
    cause: str

    def __str__(self) -> str:
        return f"#{self.number} {self.transition} {self.full_name}: {self.cause}"


@dataclass(frozen=True, slots=True)
class Plan:
    """Steps, to be carried out one after the other."""

    steps: tuple[Step, ...]

    def __str__(self) -> str:
        return "\n".join(str(step) for step in self.steps)


def bring_up(system: System, autostart: PrimaryState | None = None) -> Plan:
    """Return how the system gets from unconfigured to where it is to start.

    Every node goes as far as ``autostart`` says (the system's own, unless given), but no further
    than its own ``autostart`` and than a node it depends on that stays below the state it needs.
    """
    edges = dependency_edges(system)
    order = _nodes(system, in_dependency_order(system, edges))
    goal = system.autostart if autostart is None else autostart
    goals = _goals(order, goal)
    causes = _causes(system, edges, goal)
    return _numbered(
        (transition, node, causes[node.name.value])
        for transition, reached in _UPWARD
        for node in order
        if _rank(goals[node.name.value]) >= _rank(reached)
    )


def tear_down(system: System) -> Plan:
    """Return how the system ends: every node deactivated, then cleaned up, then shut down.

    Each phase runs in the reverse of the bring-up's order. The plan is for a system that is fully
    up; a step that a node's state at the time does not allow has nothing left to do.
    """
    edges = dependency_edges(system)
    order = _nodes(system, reversed(in_dependency_order(system, edges)))
    users = _dependents(edges)
    causes = {name: f"after {_listed(waiting)}" for name, waiting in users.items()}
    return _numbered(
        (transition, node, causes.get(node.name.value, "system is going down"))
        for transition in _DOWNWARD
        for node in order
    )


def _numbered(steps: Iterable[tuple[TransitionName, Node, str]]) -> Plan:
    return Plan(
        tuple(
            Step(number, transition, node.name.value, node.full_name, cause)
            for number, (transition, node, cause) in enumerate(steps, start=1)
        )
    )


def _nodes(system: System, names: Iterable[str]) -> tuple[Node, ...]:
    found = (system.node(name) for name in names)
    return tuple(node for node in found if node is not None)


def _goals(order: Iterable[Node], goal: PrimaryState) -> Mapping[str, PrimaryState]:
    """Return where each node is to start. ``order`` has dependencies first."""
    goals: dict[str, PrimaryState] = {}
    for node in order:
        limits = [_limit(dependency, goals) for dependency in node.depends_on]
        own = [] if node.autostart is None else [node.autostart.value]
        goals[node.name.value] = min([goal, *own, *limits], key=_rank)
    return goals


def _limit(dependency: Dependency, goals: Mapping[str, PrimaryState]) -> PrimaryState:
    """Return how far a node may go: as far as what it depends on, if that stays too low for it."""
    reached = goals.get(dependency.node.value, dependency.state)
    return PrimaryState.ACTIVE if _rank(reached) >= _rank(dependency.state) else reached


def _rank(state: PrimaryState) -> int:
    return _RANK[state]


def _causes(system: System, edges: Iterable[Edge], goal: PrimaryState) -> Mapping[str, str]:
    """Return why each node is started where it is in the order."""
    declared = _dependents(edge for edge in edges if not edge.implied)
    implied = _dependents(edge for edge in edges if edge.implied)
    causes = {}
    for node in system.nodes:
        name = node.name.value
        if name in declared:
            users = declared[name]
            verb = "depends" if len(users) == 1 else "depend"
            causes[name] = f"{_listed(users)} {verb} on it"
        elif name in implied:
            users = implied[name]
            verb = "calls" if len(users) == 1 else "call"
            causes[name] = f"{_listed(users)} {verb} it, and servers start before their clients"
        elif node.autostart is not None and _rank(node.autostart.value) < _rank(goal):
            causes[name] = f"its own autostart is {node.autostart.value}"
        else:
            causes[name] = f"system autostart is {goal}"
    return causes


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
