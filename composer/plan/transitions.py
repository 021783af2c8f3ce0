"""Plan the transitions of nodes from their states to their goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

from composer.model import Node, PrimaryState, System
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
