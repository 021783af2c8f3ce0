"""The lifecycle of plain rclpy nodes in another process."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator

import pytest

from composer.client.graph_names import NotFoundError
from composer.client.lifecycle import LifecycleClient, TransitionError
from composer.client.session import Deadline, NoResponseError, Session
from tests.ros.support.commands import hand_written
from tests.ros.support.in_process import wait_until

NODES = ("/other/arm", "/other/planner", "/planning/planner")


@pytest.fixture(scope="module", autouse=True)
def peer(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written.py") as process:
        yield process


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    """A session that has discovered all nodes, for the tests of errors."""
    with Session() as session:
        client = LifecycleClient(session, Deadline(20.0))
        wait_until(lambda: client.nodes() == NODES, "all nodes")
        yield session


@pytest.fixture
def client(session: Session) -> LifecycleClient:
    return LifecycleClient(session, Deadline(20.0))


def to_unconfigured(client: LifecycleClient, node: str) -> None:
    for transition in ("deactivate", "cleanup"):
        if transition in [item.label for item in client.transitions(node)]:
            client.change_state(node, transition)


def test_all_nodes_are_listed_with_their_states(client: LifecycleClient) -> None:
    assert client.nodes() == NODES
    assert client.states(NODES) == dict.fromkeys(NODES, "unconfigured")


#: Names that no single node has, and the hints.
WRONG_NAMES = {
    "planner": "use a full name: /other/planner, /planning/planner",  # ambiguous
    "planer": r"did you mean '/(planning|other)/planner'\?",
    "/planning/planer": r"did you mean '/(planning|other)/planner'\?",
}


def test_a_node_is_found_by_its_full_name_or_last_part(client: LifecycleClient) -> None:
    for name in ("/planning/planner", "planning/planner"):
        assert client.find(name) == "/planning/planner"
    assert client.find("arm") == "/other/arm"
    for name, hint in WRONG_NAMES.items():
        with pytest.raises(NotFoundError) as raised:
            client.find(name)
        matches = f"'{name}' matches more than one lifecycle node"
        assert (matches in str(raised.value)) is (name == "planner")
        assert re.fullmatch(hint, raised.value.hint)


def test_a_transition(client: LifecycleClient) -> None:
    node = "/planning/planner"
    to_unconfigured(client, node)
    change = client.change_state(node, "configure")
    assert (change.before, change.after) == ("unconfigured", "inactive")
    assert client.state(node) == "inactive"
    labels = {transition.label for transition in client.transitions(node)}
    assert labels == {"activate", "cleanup", "shutdown"}
    to_unconfigured(client, node)


def test_an_unavailable_transition_is_not_requested(
    client: LifecycleClient, peer: subprocess.Popen[str]
) -> None:
    node = "/planning/planner"
    to_unconfigured(client, node)
    for transition in ("activate", "cleanup", "levitate", "transition_success"):
        with pytest.raises(TransitionError) as raised:
            client.change_state(node, transition)
        assert str(raised.value) == f"'{transition}' is not possible: {node} is unconfigured"
        assert raised.value.hint == "available transitions: configure, shutdown"
        assert client.state(node) == "unconfigured"
    assert peer.poll() is None


def test_a_failed_transition_is_reported_with_the_state(client: LifecycleClient) -> None:
    with pytest.raises(TransitionError, match="'configure' of /other/arm failed") as raised:
        client.change_state("/other/arm", "configure")
    assert "it is unconfigured now" in str(raised.value)


def test_a_slow_transition_times_out(session: Session) -> None:
    client = LifecycleClient(session, Deadline(1.0))
    with pytest.raises(NoResponseError, match="/other/planner did not respond within 1 s"):
        client.change_state("/other/planner", "configure")
