"""Plan the transitions of nodes from their states to their goals."""

from __future__ import annotations

from collections.abc import Mapping

from composer.model import PrimaryState, System
from composer.model.dependencies import dependency_edges, in_dependency_order
from composer.plan.steps import Phase, Plan, build_plan, downward, nodes_of, rank, upward

_ACTIVE, _INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE


def plan_transitions(
    system: System,
    states: Mapping[str, PrimaryState],
    goals: Mapping[str, PrimaryState],
    causes: Mapping[str, str],
) -> Plan:
    """Return the plan that takes the nodes from ``states`` to ``goals``, in dependency order.

    First every transition down, in reverse order, then every transition up. ``causes`` gives the
    reason for each node. Nodes without a state or a goal are left alone.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, in_dependency_order(system, edges))
    movable = tuple(
        (node, rank(states[node.name.value]), rank(goals[node.name.value]))
        for node in order
        if node.name.value in states and node.name.value in goals
    )
    reverse = tuple(reversed(movable))
    return build_plan(
        (
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
            Phase(
                "configure",
                [node for node, state, goal in movable if state < rank(_INACTIVE) <= goal],
                upward(edges, _INACTIVE),
            ),
            Phase(
                "activate",
                [node for node, state, goal in movable if state < rank(_ACTIVE) <= goal],
                upward(edges, _ACTIVE),
            ),
        ),
        causes,
    )
