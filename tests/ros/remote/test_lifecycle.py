"""The lifecycle of nodes in another process, written by hand with rclpy."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator

import pytest

from composer.remote.lifecycle import Control, TransitionRefused
from composer.remote.name_matching import NotThere
from composer.remote.session import Deadline, NoAnswer, Session
from tests.ros.support.commands import hand_written


@pytest.fixture(scope="module", autouse=True)
def peer(shared_domain_id: int) -> Iterator[subprocess.Popen[str]]:
    with hand_written("hand_written.py") as process:
        yield process


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    with Session() as session:
        yield session


@pytest.fixture
def control(session: Session) -> Control:
    return Control(session, Deadline(20.0))


def to_unconfigured(control: Control, node: str) -> None:
    for transition in ("deactivate", "cleanup"):
        if transition in [legal.label for legal in control.transitions(node)]:
            control.change(node, transition)


def test_all_nodes_are_found_with_their_states(control: Control) -> None:
    expected = ("/other/arm", "/other/planner", "/planning/planner")
    control.find("/planning/planner")
    assert control.nodes() == expected
    assert control.states(expected) == dict.fromkeys(expected, "unconfigured")


def test_a_node_is_found_by_its_full_name_and_by_the_last_part_of_just_one(
    control: Control,
) -> None:
    assert control.find("/planning/planner") == "/planning/planner"
    assert control.find("arm") == "/other/arm"
    assert control.find("planning/planner") == "/planning/planner"


def test_a_name_that_means_two_nodes_is_refused_with_both(control: Control) -> None:
    with pytest.raises(NotThere, match="'planner' is more than one lifecycle node") as refusal:
        control.find("planner")
    assert refusal.value.hint == "say which: /other/planner, /planning/planner"


@pytest.mark.parametrize("name", ["planer", "/planning/planer"])
def test_an_unknown_name_gets_the_nearest_one(control: Control, name: str) -> None:
    with pytest.raises(NotThere) as refusal:
        control.find(name)
    assert refusal.value.hint in (
        "did you mean '/planning/planner'?",
        "did you mean '/other/planner'?",
    )


def test_a_node_goes_where_it_is_told(control: Control) -> None:
    node = "/planning/planner"
    to_unconfigured(control, node)
    change = control.change(node, "configure")
    assert (change.before, change.after) == ("unconfigured", "inactive")
    assert control.state(node) == "inactive"
    labels = {transition.label for transition in control.transitions(node)}
    assert labels == {"activate", "cleanup", "shutdown"}
    to_unconfigured(control, node)


@pytest.mark.parametrize("transition", ["activate", "cleanup", "levitate", "transition_success"])
def test_what_is_not_legal_is_never_sent_and_the_process_lives(
    control: Control, transition: str, peer: subprocess.Popen[str]
) -> None:
    to_unconfigured(control, "/planning/planner")
    with pytest.raises(TransitionRefused) as refusal:
        control.change("/planning/planner", transition)
    assert (
        str(refusal.value) == f"'{transition}' is not possible: /planning/planner is unconfigured"
    )
    assert refusal.value.hint == "possible now: configure, shutdown"
    assert control.state("/planning/planner") == "unconfigured"
    assert peer.poll() is None


def test_a_transition_that_the_node_refuses_is_told_with_the_state(control: Control) -> None:
    with pytest.raises(TransitionRefused, match="/other/arm refused 'configure'") as refusal:
        control.change("/other/arm", "configure")
    assert "it is unconfigured now" in str(refusal.value)


def test_a_node_that_takes_too_long_is_given_up_in_time(session: Session) -> None:
    started_s = time.monotonic()
    control = Control(session, Deadline(1.0))
    with pytest.raises(NoAnswer, match="/other/planner did not answer within 1 s"):
        control.change("/other/planner", "configure")
    assert time.monotonic() - started_s < 5.0  # it takes 6 s
