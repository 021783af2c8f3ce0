"""Lifecycle requests to several nodes, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.client.lifecycle import CompletedTransition, LifecycleClient
from composer.client.session import Deadline, RosError, Session
from composer.client.systems.managers import Systems
from composer.model.lifecycle import TRANSITIONS
from composer.runtime.process.instance_lock import local_systems
from composer.runtime.protocol.reports import NodeReport, SystemReport

#: Managers publish their last report to each new subscription, and again every second.
_REPORT_WITHIN_S = 2.0
_RANK = {"finalized": -1, "unconfigured": 0, "inactive": 1, "active": 2}


@dataclass(frozen=True, slots=True)
class LifecycleRequest:
    """A transition by its label, or else a goal state."""

    transition: str | None
    state: str | None

    def goal(self, state: str) -> str | None:
        """Return the goal for a node in ``state``; None if the transition is not available."""
        if self.state is not None:
            return self.state
        wanted = TRANSITIONS.get(self.transition or "")
        return wanted.goal if wanted is not None and state in wanted.ids else None


#: The result of a request for one node, or the error.
NodeOutcome: TypeAlias = CompletedTransition | RosError


class LifecycleBatch:
    """A request to several nodes, one after the other, and the nodes that depend on them.

    ``active_dependents`` are the active nodes that depend on those that the request takes down, in
    the reverse order of the bring-up. Managers report dependencies; a node without a manager has
    none.
    """

    def __init__(
        self,
        session: Session,
        deadline: Deadline,
        targets: Iterable[str],
        request: LifecycleRequest,
    ) -> None:
        """Find the nodes. Raises NotFoundError, NoResponseError."""
        self._client = LifecycleClient(session, deadline)
        self._request = request
        self._nodes = self._client.select(targets)
        reports = _system_reports(session, deadline)
        #: Systems whose dependencies are unknown, because their managers do not respond.
        self.silent_systems = [name for name, report in reports.items() if report is None]
        self.active_dependents: tuple[str, ...] = ()
        self._inactive_dependents: tuple[str, ...] = ()
        for report in filter(None, reports.values()):
            goals = self._goals(report.nodes)
            down = lowered(report.nodes, goals)
            up = {name: goal for name, goal in goals.items() if name not in down}
            self.active_dependents += active_dependents(report.nodes, down)
            self._inactive_dependents += inactive_dependents(report.nodes, up)

    def run(self, *, dependents: bool) -> Iterator[NodeOutcome]:
        """Carry out the request for each node; continue after an error.

        With ``dependents``, active dependents are deactivated before it, and inactive ones that can
        be active after it are activated, unless there was an error.
        """
        client, failed = self._client, False
        changes = [partial(self._change, node) for node in self._nodes]
        if dependents:
            before = self.active_dependents
            changes[:0] = (partial(client.follow_to_state, node, "inactive") for node in before)
        for change in changes:
            outcome = _outcome(change)
            failed = failed or isinstance(outcome, RosError)
            yield outcome
        for node in self._inactive_dependents if dependents and not failed else ():
            yield _outcome(partial(client.follow_to_state, node, "active"))

    def _goals(self, nodes: Iterable[NodeReport]) -> dict[str, str]:
        """Return the states to which the request takes nodes of a system from other ones."""
        goals = {}
        for node in nodes:
            goal = self._request.goal(node.state)
            if node.node in self._nodes and goal is not None and goal != node.state:
                goals[node.node] = goal
        return goals

    def _change(self, node: str) -> CompletedTransition:
        if self._request.state is not None:
            return self._client.go_to_state(node, self._request.state)
        return self._client.change_state(node, self._request.transition or "")


def _outcome(change: Callable[[], CompletedTransition]) -> NodeOutcome:
    try:
        return change()
    except RosError as error:
        return error


def _system_reports(session: Session, deadline: Deadline) -> dict[str, SystemReport | None]:
    """Return the reports of the known systems, None for those that do not respond."""
    systems = Systems(session, deadline)
    limit = Deadline(min(_REPORT_WITHIN_S, deadline.left_s))
    return systems.reports({*systems.discover(), *local_systems()}, limit)


def lowered(nodes: Iterable[NodeReport], goals: Mapping[str, str]) -> dict[str, str]:
    """Return the goals that are below the states of their nodes."""
    return {
        node.node: goals[node.node]
        for node in nodes
        if node.node in goals and _rank(goals[node.node]) < _rank(node.state)
    }


def active_dependents(nodes: Sequence[NodeReport], goals: Mapping[str, str]) -> tuple[str, ...]:
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


def inactive_dependents(nodes: Sequence[NodeReport], goals: Mapping[str, str]) -> tuple[str, ...]:
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


def _lacks_any(node: NodeReport, states: Mapping[str, str]) -> bool:
    """Return whether a dependency of the node is below the state that it must have."""
    return any(
        _rank(states[on]) < _rank(state) for on, state in node.depends_on.items() if on in states
    )


def _rank(state: str) -> int:
    """Return the rank of a state; a transition state ranks as inactive."""
    return _RANK.get(state, _RANK["inactive"])
