"""Plans to bring a system, or parts of it, up and down: steps, each with its cause.

A plan is data: it decides everything, and the runtime carries it out. Nodes are configured and then
activated after the nodes they depend on, and taken down in reverse order; independent nodes may
move at the same time. :mod:`composer.model.dependencies` defines the dependencies.
"""

from composer.plan.desired_state import (
    Condition,
    Decision,
    DesiredState,
    Fault,
    FaultKind,
    Restart,
    decide,
)
from composer.plan.reconciliation import (
    STARTING,
    blocked_nodes,
    conditions,
    desired_states,
    is_nothing_left,
    is_settled,
    optional_nodes,
    reconcile,
)
from composer.plan.transitions import (
    Plan,
    Step,
    TransitionName,
    bring_up,
    plan_transitions,
    start_causes,
    start_goals,
    tear_down,
)
