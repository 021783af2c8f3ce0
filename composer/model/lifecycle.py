"""The lifecycle of ROS 2 nodes: states and transitions, for everything that names them.

See design.ros2.org/articles/node_lifecycle.html. Ids are as in lifecycle_msgs/msg/Transition.
"""

from __future__ import annotations

from collections.abc import Mapping
from operator import itemgetter
from typing import NamedTuple

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = "unconfigured", "inactive", "active", "finalized"
#: The states between transitions. No transition leaves the last one.
PRIMARY_STATES = (UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED)


class Transition(NamedTuple):
    """A transition: its id by the state in which it starts, the state while it runs, its goal."""

    ids: Mapping[str, int]
    during: str
    goal: str


#: The transitions by their names.
TRANSITIONS: Mapping[str, Transition] = {
    "configure": Transition({UNCONFIGURED: 1}, "configuring", INACTIVE),
    "activate": Transition({INACTIVE: 3}, "activating", ACTIVE),
    "deactivate": Transition({ACTIVE: 4}, "deactivating", INACTIVE),
    "cleanup": Transition({INACTIVE: 2}, "cleaningup", UNCONFIGURED),
    "shutdown": Transition({UNCONFIGURED: 5, INACTIVE: 6, ACTIVE: 7}, "shuttingdown", FINALIZED),
}


def available_transitions(state: str) -> dict[str, int]:
    """Return the ids of the transitions that start in a state, by name, in the order of rcl."""
    found = {name: item.ids[state] for name, item in TRANSITIONS.items() if state in item.ids}
    return dict(sorted(found.items(), key=itemgetter(1)))


def next_transition(state: str, goal: str) -> str | None:
    """Return the first transition on the way from a primary state to another, None without one."""
    available = available_transitions(state)
    direct = next((name for name in available if TRANSITIONS[name].goal == goal), None)
    if direct is not None or state == goal or goal not in PRIMARY_STATES:
        return direct
    # Two steps away: up from unconfigured, down from active.
    return next((name for name in available if TRANSITIONS[name].goal == INACTIVE), None)


def last_transition(state: str, goal: str) -> str:
    """Return the last transition on the way from a primary state to another, which is its goal."""
    if goal == INACTIVE:
        return "deactivate" if state == ACTIVE else "configure"
    return next(name for name, item in TRANSITIONS.items() if item.goal == goal)
