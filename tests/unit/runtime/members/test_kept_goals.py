"""The latest goals win, over several coordinating processes."""

from __future__ import annotations

import pytest

from composer.model import PrimaryState, System
from composer.plan import STOPPED, SystemGoals
from composer.runtime.members.kept_goals import KeptGoals
from tests.unit.support.resolving import system_of

ACTIVE, INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE
BOTH = {"arm": ACTIVE, "eye": ACTIVE}


@pytest.fixture
def goals() -> KeptGoals:
    return KeptGoals(robot())


def robot() -> System:
    return system_of("{system: robot, nodes: {arm: {}, eye: {}}}")


def running(serial: int) -> SystemGoals:
    return SystemGoals(serial, "running")


def test_the_goals_with_the_highest_serial_are_used(goals: KeptGoals) -> None:
    highest = SystemGoals(7, "paused", INACTIVE)
    for found in (running(4), highest, None, SystemGoals(5, "reset", PrimaryState.UNCONFIGURED)):
        assert goals.on_report(found) is None
    assert goals.found == highest
    changed = goals.change({"arm": ACTIVE, "eye": INACTIVE}, "running")
    assert changed == SystemGoals(8, "running", ACTIVE, {"/eye": INACTIVE})


def test_goals_that_have_not_changed_are_not_sent(goals: KeptGoals) -> None:
    assert goals.change(BOTH, "running") == running(0)
    assert goals.change(BOTH, "running") is None
    assert goals.change(BOTH, "paused") == SystemGoals(1, "paused")


def test_a_process_with_other_goals_gets_those_of_now(goals: KeptGoals) -> None:
    goals.change(BOTH, "running")
    assert goals.on_report(running(0)) is None
    assert goals.on_report(None) == running(0)
    assert goals.on_report(SystemGoals(9, "paused", INACTIVE)) == running(10)  # found too late
    assert goals.on_report(running(0)) == running(10)
    assert goals.on_report(running(10)) is None


def test_a_shutdown_ends_a_pause(goals: KeptGoals) -> None:
    assert goals.stop() is None  # nothing has been brought up
    goals.change(dict.fromkeys(BOTH, INACTIVE), "paused")
    stopped = goals.stop()
    assert stopped == SystemGoals(1, STOPPED)
    following = KeptGoals(robot())
    following.on_report(stopped)
    assert following.found is None
    assert following.change(BOTH, "running") == running(2)
