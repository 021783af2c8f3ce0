"""From where the nodes are to where they are wanted."""

from __future__ import annotations

from collections.abc import Mapping

from composer.model import PrimaryState, System
from composer.model.dependencies import dependency_edges, in_dependency_order
from composer.plan.steps import Phase, Plan, downward, nodes_of, plan_of, rank, upward

_ACTIVE, _INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE


def reach(
    system: System,
    states: Mapping[str, PrimaryState],
    goals: Mapping[str, PrimaryState],
    causes: Mapping[str, str],
) -> Plan:
    """Return how the nodes get from ``states`` to ``goals``, in dependency order.

    First all that goes down, in reverse, then all that goes up. ``causes`` tells for every node why
    it moves. Nodes without a state or a goal are left alone: there is no way for them.
    """
    edges = dependency_edges(system)
    order = nodes_of(system, in_dependency_order(system, edges))
    known = tuple(
        (node, rank(states[node.name.value]), rank(goals[node.name.value]))
        for node in order
        if node.name.value in states and node.name.value in goals
    )
    falling = tuple(reversed(known))
    return plan_of(
        (
            Phase(
                "deactivate",
                [node for node, here, goal in falling if goal < rank(_ACTIVE) <= here],
                downward(edges, _ACTIVE),
            ),
            Phase(
                "cleanup",
                [node for node, here, goal in falling if goal < rank(_INACTIVE) <= here],
                downward(edges, _INACTIVE),
            ),
            Phase(
                "configure",
                [node for node, here, goal in known if here < rank(_INACTIVE) <= goal],
                upward(edges, _INACTIVE),
            ),
            Phase(
                "activate",
                [node for node, here, goal in known if here < rank(_ACTIVE) <= goal],
                upward(edges, _ACTIVE),
            ),
        ),
        causes,
    )
