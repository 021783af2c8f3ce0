"""Plans: the steps that bring a system, or parts of it, up and down, each step with its cause.

A plan is data: this package decides everything, and the runtime executes it without decisions of
its own. Nodes are configured and then activated after the nodes that they depend on, and taken down
in reverse order; independent nodes may move at the same time. :mod:`composer.model.dependencies`
defines which node waits for which.
"""

from composer.plan.reach import reach
from composer.plan.reconciliation import (
    Decision,
    DesiredState,
    Fault,
    FaultKind,
    judge,
    mend,
    wanted,
)
from composer.plan.steps import Plan, Step, TransitionName
from composer.plan.whole import bring_up, start_causes, start_goals, tear_down

__all__ = [
    "Decision",
    "DesiredState",
    "Fault",
    "FaultKind",
    "Plan",
    "Step",
    "TransitionName",
    "bring_up",
    "judge",
    "mend",
    "reach",
    "start_causes",
    "start_goals",
    "tear_down",
    "wanted",
]
