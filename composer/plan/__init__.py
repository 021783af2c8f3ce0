"""What is done to bring a system, or parts of it, up and down: steps, each with its cause.

A plan is data. It decides everything and does nothing; the runtime does it and decides nothing
(DESIGN: The way data flows). Nodes are configured and then activated behind the nodes they depend
on, and taken down in reverse; what does not depend on each other may move at the same time. What
waits for what is told by :mod:`composer.model.dependencies`.
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
