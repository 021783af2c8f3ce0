"""Which other nodes a lifecycle request affects: those that depend on the requested ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

_RANK = {"finalized": -1, "unconfigured": 0, "inactive": 1, "active": 2}


class ReportedNode(Protocol):
    """What is needed of a :class:`composer.client.systems.system_reports.NodeReport`."""

    @property
    def node(self) -> str:
        """The full name."""

    @property
    def state(self) -> str:
        """The label of the lifecycle state."""

    @property
    def depends_on(self) -> Mapping[str, str]:
        """The states that the nodes it depends on must have, by their full names."""


def lowered(nodes: Iterable[ReportedNode], goals: Mapping[str, str]) -> dict[str, str]:
    """Return the goals that are below the states of their nodes."""
    return {
        node.node: goals[node.node]
        for node in nodes
        if node.node in goals and _rank(goals[node.node]) < _rank(node.state)
    }


def active_dependents(nodes: Sequence[ReportedNode], goals: Mapping[str, str]) -> tuple[str, ...]:
    """Return the active nodes that cannot do without the nodes with ``goals``, if those reach them.

    ``nodes`` are in the order of the bring-up, the result is in the reverse order.
    """
    states = dict(goals)
    found = []
    for node in nodes:
        if node.node not in goals and node.state == "active" and _lacks_any(node, states):
            states[node.node] = "inactive"
            found.append(node.node)
    return tuple(reversed(found))


def inactive_dependents(nodes: Sequence[ReportedNode], goals: Mapping[str, str]) -> tuple[str, ...]:
    """Return the inactive nodes that can be active once the nodes with ``goals`` have reached them.

    Only nodes that depend on one of those are included, directly or indirectly. ``nodes`` and the
    result are in the order of the bring-up.
    """
    states = {node.node: node.state for node in nodes} | dict(goals)
    affected = set(goals)
    found = []
    for node in nodes:
        is_dependent = not affected.isdisjoint(node.depends_on)
        if node.node in goals or node.state != "inactive" or not is_dependent:
            continue
        if not _lacks_any(node, states):
            states[node.node] = "active"
            affected.add(node.node)
            found.append(node.node)
    return tuple(found)


def _lacks_any(node: ReportedNode, states: Mapping[str, str]) -> bool:
    """Return whether a dependency of the node is below the state that it must have."""
    return any(
        _rank(states[on]) < _rank(state) for on, state in node.depends_on.items() if on in states
    )


def _rank(state: str) -> int:
    """Return the rank of a state; a transition state ranks as inactive."""
    return _RANK.get(state, _RANK["inactive"])
