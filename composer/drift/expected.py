"""What a running system should look like: the nodes a file declares, once they are brought up."""

from __future__ import annotations

from composer.model import PrimaryState, System
from composer.plan import bring_up

_REACHED = {"configure": "inactive", "activate": "active"}


def states_after_bring_up(system: System, autostart: PrimaryState | None = None) -> dict[str, str]:
    """Return the lifecycle state that each node (by its key in the system) is brought to."""
    states = dict.fromkeys((node.name.value for node in system.nodes), "unconfigured")
    for step in bring_up(system, autostart).steps:
        states[step.node] = _REACHED.get(step.transition, states[step.node])
    return states
