"""Plans to bring a system, or parts of it, up and down: steps, each with its cause.

A plan is data: it decides everything, and the runtime carries it out. Nodes are configured and then
activated after the nodes they depend on, and taken down in reverse order; independent nodes may
move at the same time. :mod:`composer.model.dependencies` defines the dependencies.
"""

from composer.plan.bringup import bring_up, start_causes, start_goals, tear_down
from composer.plan.desired_state import DesiredState, Fault, FaultKind, Restart
from composer.plan.reconciliation import (
    Decision,
    blocked_nodes,
    decide,
    desired_states,
    reconcile,
)
from composer.plan.steps import Plan, Step, TransitionName
from composer.plan.system_goals import STOPPED, SystemGoals, parse_goals, system_goals
from composer.plan.transitions import plan_transitions

__all__ = [
    "STOPPED",
    "Decision",
    "DesiredState",
    "Fault",
    "FaultKind",
    "Plan",
    "Restart",
    "Step",
    "SystemGoals",
    "TransitionName",
    "blocked_nodes",
    "bring_up",
    "decide",
    "desired_states",
    "parse_goals",
    "plan_transitions",
    "reconcile",
    "start_causes",
    "start_goals",
    "system_goals",
    "tear_down",
]
