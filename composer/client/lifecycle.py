"""The lifecycle of nodes in other processes.

It uses the standard services (lifecycle_msgs), so it works with every lifecycle node. A
transition is requested only if the node lists it as available: an invalid request ends the process
of an rclpy lifecycle node.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

from lifecycle_msgs.msg import Transition as TransitionMessage
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rclpy.type_support import check_is_valid_srv_type

from composer.base.fast_dataclass import dataclass
from composer.client.graph_names import check_all_respond, find_node, not_found_error
from composer.client.session import Deadline, NoResponseError, RosError, Session
from composer.client.systems.node_services import NodeServices
from composer.model.lifecycle import PRIMARY_STATES, TRANSITIONS, next_transition
from composer.model.names import is_pattern, is_selected
from composer.runtime.protocol.reports import NodeReport, SystemReport

_RANK = {"finalized": -1, "unconfigured": 0, "inactive": 1, "active": 2}


class TransitionError(RosError):
    """The transition is not available in the state of the node, or it failed."""


@dataclass(frozen=True, slots=True)
class Transition:
    """An available transition and its goal state."""

    id: int
    label: str
    goal: str


@dataclass(frozen=True, slots=True)
class CompletedTransition:
    """The primary states before and after one or more transitions."""

    node: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.node}: {self.before} -> {self.after}"


class LifecycleClient:
    """Queries and changes lifecycle nodes, all within one time limit."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._services = NodeServices(session)
        for service in (GetState, GetAvailableTransitions, ChangeState):
            check_is_valid_srv_type(service)  # takes 0.1 s, during which discovery runs

    def nodes(self) -> tuple[str, ...]:
        """Return the full names of all lifecycle nodes, once discovery is complete."""
        return self._session.wait_until_settled(self.known, self._deadline)

    def find(self, name: str) -> str:
        """Return the full name of a node. Raises NotFoundError, NoResponseError."""
        return find_node(self._session, self._deadline, name, self.known, "lifecycle node")

    def select(self, targets: Iterable[str]) -> tuple[str, ...]:
        """Return the full names of the nodes that match the targets, each once, in order.

        A target is a name as for :meth:`find`, or a pattern. Raises NotFoundError,
        NoResponseError.
        """
        selected: dict[str, None] = {}
        for target in targets:
            if not is_pattern(target):
                selected[self.find(target)] = None
                continue
            known = self.nodes()
            check_all_respond(self._session)
            matches = [name for name in known if is_selected(name, target)]
            if not matches:
                raise not_found_error("lifecycle node matching", target, known)
            selected.update(dict.fromkeys(matches))
        return tuple(selected)

    def state(self, node: str) -> str:
        """Return the label of the node's state. Raises NoResponseError."""
        response = self._call(node, GetState, GetState.Request())
        return str(response.current_state.label)

    def states(self, nodes: Iterable[str]) -> dict[str, str | None]:
        """Return the label of each node's state, None for nodes that did not respond in time."""
        return self._services.states(nodes, self._deadline)

    def transitions(self, node: str) -> tuple[Transition, ...]:
        """Return the transitions that are available now. Raises NoResponseError."""
        response = self._call(node, GetAvailableTransitions, GetAvailableTransitions.Request())
        return tuple(
            Transition(item.transition.id, item.transition.label, item.goal_state.label)
            for item in response.available_transitions
        )

    def change_state(self, node: str, label: str) -> CompletedTransition:
        """Request the transition ``label`` of a node.

        Raises TransitionError with the available transitions; NoResponseError.
        """
        before = self.state(node)
        available = self.transitions(node)
        transition = next((item for item in available if item.label == label), None)
        if transition is None:
            raise TransitionError(
                f"'{label}' is not possible: {node} is {before}", _hint(before, available)
            )
        # The label makes the request fail cleanly if the state has changed in the meantime.
        message = TransitionMessage(id=transition.id, label=label)
        request = ChangeState.Request(transition=message)
        response = self._call(node, ChangeState, request, once=True)
        after = self.state(node)
        if not response.success:
            raise TransitionError(
                f"'{label}' of {node} failed: it is {after} now", "see its log for the reason"
            )
        return CompletedTransition(node, before, after)

    def go_to_state(self, node: str, goal: str) -> CompletedTransition:
        """Take a node to a primary state in as many transitions as it needs.

        Raises TransitionError if the state cannot be reached or a transition fails;
        NoResponseError.
        """
        before = state = self.state(node)
        while state != goal:
            label = next_transition(state, goal)
            if label is None:
                raise TransitionError(
                    f"'{goal}' cannot be reached: {node} is {state}",
                    _hint(state, self.transitions(node)),
                )
            reached = self.change_state(node, label).after
            if reached == state:
                raise TransitionError(f"{node} is still {state} after '{label}'")
            state = reached
        return CompletedTransition(node, before, state)

    def follow_to_state(self, node: str, goal: str) -> CompletedTransition:
        """Take a node to a state to which its system may take it at the same time.

        Raises the same as :meth:`go_to_state`.
        """
        before = self._settled_state(node)
        try:
            self.go_to_state(node, goal)
        except TransitionError:
            if self._settled_state(node) != goal:
                raise
        return CompletedTransition(node, before, goal)

    def _settled_state(self, node: str) -> str:
        """Return the state of a node once no transition runs, or at the end of the time limit."""

        def primary() -> str | None:
            state = self.state(node)
            return state if state in PRIMARY_STATES else None

        return self._session.wait_for(primary, self._deadline) or self.state(node)

    def known(self) -> tuple[str, ...]:
        """Return the full names of the lifecycle nodes discovered so far."""
        return tuple(sorted(self._services.nodes(GetState, self._deadline)))

    def reports(self) -> dict[str, SystemReport | None]:
        """Return the reports of the known systems, None for those that do not respond."""
        return self._services.reports(self._deadline)

    def close(self) -> None:
        """Destroy clients and subscriptions; the end of the session does so too."""
        self._services.close()

    def _call(self, node: str, kind: Any, request: Any, *, once: bool = False) -> Any:
        try:
            return self._services.call(kind, node, request, self._deadline, once=once)
        except NoResponseError as error:
            raise NoResponseError(
                f"{node} did not respond within {self._deadline.timeout_s:g} s",
                f"{error}; its process may be busy or gone. Use --timeout to wait longer",
            ) from error


def _hint(state: str, available: tuple[Transition, ...]) -> str:
    if state not in PRIMARY_STATES:
        return "a transition is in progress: wait, or see its log if it does not end"
    names = ", ".join(dict.fromkeys(transition.label for transition in available))
    return f"available transitions: {names or 'none, this state is final'}"


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
        self, client: LifecycleClient, targets: Iterable[str], request: LifecycleRequest
    ) -> None:
        """Find the nodes. Raises NotFoundError, NoResponseError."""
        self._client = client
        self._request = request
        self._nodes = client.select(targets)
        reports = client.reports()
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
