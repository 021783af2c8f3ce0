"""The latest goals win, over several coordinating processes."""

from __future__ import annotations

import pytest

from composer.model import PrimaryState, System
from composer.runtime.members.kept_goals import KeptGoals
from tests.unit.support.resolving import system_of

ACTIVE, INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE


@pytest.fixture
def goals() -> KeptGoals:
    return KeptGoals(robot())


def robot() -> System:
    return system_of("{system: robot, nodes: {arm: {}, eye: {}}}")


def test_the_goals_with_the_highest_serial_are_used(goals: KeptGoals) -> None:
    for text in ("4 running active", "7 paused inactive", "", "5 reset unconfigured"):
        assert goals.on_report(text) is None
    assert str(goals.found) == "7 paused inactive"
    assert goals.change({"arm": ACTIVE, "eye": INACTIVE}, "running") == (
        "8 running active /eye=inactive"
    )


def test_goals_that_have_not_changed_are_not_sent(goals: KeptGoals) -> None:
    assert goals.change({"arm": ACTIVE, "eye": ACTIVE}, "running") == "0 running active"
    assert goals.change({"arm": ACTIVE, "eye": ACTIVE}, "running") is None
    assert goals.change({"arm": ACTIVE, "eye": ACTIVE}, "paused") == "1 paused active"


def test_a_process_with_other_goals_gets_those_of_now(goals: KeptGoals) -> None:
    goals.change({"arm": ACTIVE, "eye": ACTIVE}, "running")
    assert goals.on_report("0 running active") is None
    assert goals.on_report("") == "0 running active"
    assert goals.on_report("9 paused inactive") == "10 running active"  # found too late
    assert goals.on_report("0 running active") == "10 running active"
    assert goals.on_report("10 running active") is None


def test_a_shutdown_ends_a_pause(goals: KeptGoals) -> None:
    assert goals.stop() is None  # nothing has been brought up
    goals.change({"arm": INACTIVE, "eye": INACTIVE}, "paused")
    text = goals.stop()
    assert text == "1 stopped active"
    following = KeptGoals(robot())
    following.on_report(text)
    assert following.found is None
    assert following.change({"arm": ACTIVE, "eye": ACTIVE}, "running") == "2 running active"
