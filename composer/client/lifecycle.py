"""The lifecycle of nodes in other processes.

It uses the standard services (lifecycle_msgs), so it works with every lifecycle node. A
transition is requested only if the node lists it as available: an invalid request ends the process
of an rclpy lifecycle node.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from lifecycle_msgs.msg import Transition as TransitionMessage
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rclpy.type_support import check_is_valid_srv_type

from composer.base.fast_dataclass import dataclass
from composer.client.graph_names import check_all_respond, find_node, not_found_error
from composer.client.session import Deadline, NoResponseError, RosError, Session
from composer.client.systems.node_services import NodeServices
from composer.model.lifecycle import PRIMARY_STATES, next_transition
from composer.model.names import is_pattern, is_selected


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
