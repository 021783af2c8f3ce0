"""Lifecycle requests to several nodes, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from composer.remote.lifecycle import CompletedTransition, LifecycleClient
from composer.remote.session import Deadline, RosError, Session
from composer.remote.systems import Systems

_UPWARD = ("configure", "activate")
_RANK = {"unconfigured": 0, "inactive": 1, "active": 2}


@dataclass(frozen=True, slots=True)
class LifecycleRequest:
    """A transition by its label, or else a goal state."""

    transition: str | None
    state: str | None


@dataclass(frozen=True, slots=True)
class NodeOutcome:
    """The result of a request for one node, or the error."""

    result: CompletedTransition | None
    error: RosError | None


def nodes_of_system(
    session: Session, deadline: Deadline, name: str, request: LifecycleRequest
) -> tuple[str, ...]:
    """Return the nodes of a running system in the order of the request.

    First the nodes to take down, in the reverse order of the bring-up, then the nodes to bring up,
    in its order. Raises NotFoundError, NoResponseError.
    """
    systems = Systems(session, deadline)
    nodes = systems.report(systems.find(name)).nodes
    names = [node.node for node in nodes]
    if request.state is None:
        return tuple(names if request.transition in _UPWARD else names[::-1])
    goal = _RANK.get(request.state, -1)
    going_down = [node.node for node in nodes if _RANK.get(node.state, 0) > goal]
    return (*going_down[::-1], *(node for node in names if node not in going_down))


def change_each(
    session: Session, deadline: Deadline, targets: Iterable[str], request: LifecycleRequest
) -> Iterator[NodeOutcome]:
    """Carry out the request for each matching node; continue after an error.

    Raises NotFoundError before the first request.
    """
    client = LifecycleClient(session, deadline)
    for node in client.select(targets):
        try:
            yield NodeOutcome(_change_one(client, node, request), None)
        except RosError as error:
            yield NodeOutcome(None, error)


def _change_one(
    client: LifecycleClient, node: str, request: LifecycleRequest
) -> CompletedTransition:
    if request.state is not None:
        return client.go_to_state(node, request.state)
    return client.change_state(node, request.transition or "")
