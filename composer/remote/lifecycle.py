"""The lifecycle of nodes in other processes, whoever wrote them: for the command line.

Everything goes through the standard services (lifecycle_msgs), so hand-written nodes answer as
ours do. A transition is sent only when the node says it is legal: sent at the wrong moment it would
end the process of a hand-written rclpy node.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from lifecycle_msgs.msg import Transition as TransitionMessage
from lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from rclpy.type_support import check_is_valid_srv_type

from composer.remote.name_matching import check_all_answer, find_node, not_there
from composer.remote.proxies import LIFECYCLE, Deputies
from composer.remote.requests import Send, ask, ask_each, call_once
from composer.remote.session import Deadline, NoAnswer, RosError, Session

PRIMARY_STATES = ("unconfigured", "inactive", "active", "finalized")
_PATTERN = re.compile(r"[*?\[]")
#: By goal and state: the next transition on the way.
_WAYS = {
    "unconfigured": {"inactive": "cleanup", "active": "deactivate"},
    "inactive": {"unconfigured": "configure", "active": "deactivate"},
    "active": {"unconfigured": "configure", "inactive": "activate"},
    "finalized": dict.fromkeys(("unconfigured", "inactive", "active"), "shutdown"),
}
_STATE_SERVICE = "/get_state"
_STATE_TYPE = "lifecycle_msgs/srv/GetState"


class TransitionRefused(RosError):
    """The transition is not legal in the node's state, or the node did not carry it out."""


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition that is legal now and the state it leads through."""

    id: int
    label: str
    goal: str


@dataclass(frozen=True, slots=True)
class Change:
    """The primary states before and after a transition."""

    node: str
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.node}: {self.before} -> {self.after}"


#: What is legal in each state, for nodes that are not asked themselves (lifecycle_msgs).
_LEGAL = {
    "unconfigured": (
        Transition(TransitionMessage.TRANSITION_CONFIGURE, "configure", "configuring"),
        Transition(TransitionMessage.TRANSITION_UNCONFIGURED_SHUTDOWN, "shutdown", "shuttingdown"),
    ),
    "inactive": (
        Transition(TransitionMessage.TRANSITION_CLEANUP, "cleanup", "cleaningup"),
        Transition(TransitionMessage.TRANSITION_ACTIVATE, "activate", "activating"),
        Transition(TransitionMessage.TRANSITION_INACTIVE_SHUTDOWN, "shutdown", "shuttingdown"),
    ),
    "active": (
        Transition(TransitionMessage.TRANSITION_DEACTIVATE, "deactivate", "deactivating"),
        Transition(TransitionMessage.TRANSITION_ACTIVE_SHUTDOWN, "shutdown", "shuttingdown"),
    ),
}


class Control:
    """Asks lifecycle nodes things, all within one time limit."""

    def __init__(self, session: Session, deadline: Deadline) -> None:
        self._session = session
        self._deadline = deadline
        self._deputies = Deputies(session)
        for service in (GetState, GetAvailableTransitions, ChangeState):
            check_is_valid_srv_type(service)  # it takes a tenth of a second, and nobody is met yet

    def nodes(self) -> tuple[str, ...]:
        """Return the full names of all lifecycle nodes, once discovery stands still."""
        return self._session.wait_until_still(self.known, self._deadline)

    def check_all_answer(self) -> None:
        """Raise NoAnswer when there is a system here whose nodes are not known."""
        check_all_answer(self._session)

    def find(self, name: str) -> str:
        """Return the full name of the node that ``name`` means. Raises NotThere and NoAnswer."""
        return find_node(self._session, self._deadline, name, self.known, "lifecycle node")

    def select(self, targets: Iterable[str]) -> tuple[str, ...]:
        """Return the full names of all nodes that are meant, each once, in the targets' order.

        A target is what :meth:`find` takes, or a pattern: ``/planning/*``, ``*_driver``; without a
        slash it is held against the last parts of the names. Raises NotThere and NoAnswer.
        """
        found: dict[str, None] = {}
        for target in targets:
            if not _PATTERN.search(target):
                found[self.find(target)] = None
                continue
            known = self.nodes()
            check_all_answer(self._session)
            matches = [name for name in known if _matches(name, target)]
            if not matches:
                raise not_there("lifecycle node like", target, known)
            found.update(dict.fromkeys(matches))
        return tuple(found)

    def state(self, node: str) -> str:
        """Return the label of the node's state. Raises NoAnswer."""
        if self._manager(node):
            return self._deputies.state(node)
        response = self._response(ask, node, GetState, "get_state", GetState.Request())
        return str(response.current_state.label)

    def states(self, nodes: Iterable[str]) -> dict[str, str | None]:
        """Return the label of each node's state; None for a node that did not answer in time."""
        wanted = tuple(nodes)
        told: dict[str, str | None] = {
            node: self._deputies.state(node) for node in wanted if self._manager(node)
        }
        services = {f"{node}/get_state": node for node in wanted if node not in told}
        responses = ask_each(self._session, GetState, services, GetState.Request(), self._deadline)
        return told | {
            node: None if response is None else str(response.current_state.label)
            for node, response in zip(services.values(), responses.values(), strict=True)
        }

    def transitions(self, node: str) -> tuple[Transition, ...]:
        """Return what is legal now. Raises NoAnswer."""
        if self._manager(node):
            return _LEGAL.get(self._deputies.state(node), ())
        request = GetAvailableTransitions.Request()
        response = self._response(
            ask, node, GetAvailableTransitions, "get_available_transitions", request
        )
        return tuple(
            Transition(item.transition.id, item.transition.label, item.goal_state.label)
            for item in response.available_transitions
        )

    def change(self, node: str, label: str) -> Change:
        """Take the node through the transition ``label``.

        Raises TransitionRefused, with the state and what is legal in it; NoAnswer.
        """
        before = self.state(node)
        legal = self.transitions(node)
        wanted = next((transition for transition in legal if transition.label == label), None)
        if wanted is None:
            raise TransitionRefused(
                f"'{label}' is not possible: {node} is {before}", _possible(before, legal)
            )
        success, after = self._make(node, before, wanted)
        if not success:
            raise TransitionRefused(
                f"{node} refused '{label}': it is {after} now", "its log says why"
            )
        return Change(node, before, after)

    def take(self, node: str, goal: str) -> Change:
        """Take the node to a primary state by the legal way, which may be none or several steps.

        Raises TransitionRefused where there is no way or a step is refused; NoAnswer.
        """
        before = state = self.state(node)
        while state != goal:
            label = _WAYS.get(goal, {}).get(state)
            if label is None:
                raise TransitionRefused(
                    f"there is no way to '{goal}': {node} is {state}",
                    _possible(state, self.transitions(node)),
                )
            reached = self.change(node, label).after
            if reached == state:
                raise TransitionRefused(f"{node} stays {state}: '{label}' led nowhere")
            state = reached
        return Change(node, before, state)

    def _make(self, node: str, before: str, wanted: Transition) -> tuple[bool, str]:
        """Have a transition made; return whether it was, and the state after it."""
        manager = self._manager(node)
        # With the label, a state that has changed since is a refusal and not a fault in the node.
        label = f"{node} {wanted.label}" if manager else wanted.label
        message = TransitionMessage(id=wanted.id, label=label)
        request = ChangeState.Request(transition=message)
        response = self._response(call_once, manager or node, ChangeState, "change_state", request)
        success = bool(response.success)
        if not manager:
            return success, self.state(node)
        return success, self._deputies.state_after(
            node, before if success else None, self._deadline
        )

    def _manager(self, node: str) -> str | None:
        """Return the manager that answers for the lifecycle of a node, if one does."""
        return self._deputies.nodes(LIFECYCLE).get(node)

    def known(self) -> tuple[str, ...]:
        """Return the full names of the lifecycle nodes that are known now."""
        self._deputies.meet(self._deadline)
        own = {
            name.removesuffix(_STATE_SERVICE)
            for name, types in self._session.node.get_service_names_and_types()
            if name.endswith(_STATE_SERVICE) and _STATE_TYPE in types
        }
        return tuple(sorted(own | self._deputies.nodes(LIFECYCLE).keys()))

    def _response(self, send: Send, node: str, service: Any, name: str, request: Any) -> Any:
        try:
            return send(self._session, service, f"{node}/{name}", request, self._deadline)
        except NoAnswer as error:
            raise NoAnswer(
                f"{node} did not answer within {self._deadline.timeout_s:g} s",
                f"{error}; its process may be busy or gone. --timeout gives it longer",
            ) from error


def _matches(node: str, pattern: str) -> bool:
    return fnmatchcase(node if "/" in pattern else node.rpartition("/")[2], pattern)


def _possible(state: str, legal: tuple[Transition, ...]) -> str:
    if state not in PRIMARY_STATES:
        return "it is in mid-transition: wait, or see its log for what it hangs in"
    names = ", ".join(dict.fromkeys(transition.label for transition in legal))
    return f"possible now: {names or 'nothing, this state is final'}"
