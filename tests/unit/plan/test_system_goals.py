"""What is requested of a system, as the processes of the system keep it."""

from __future__ import annotations

import pytest

from composer.model import PrimaryState, System
from composer.plan import SystemGoals, parse_goals, start_goals, system_goals
from tests.unit.support.resolving import system_of

ACTIVE, INACTIVE, UNCONFIGURED = (
    PrimaryState.ACTIVE,
    PrimaryState.INACTIVE,
    PrimaryState.UNCONFIGURED,
)


@pytest.fixture(scope="module")
def robot() -> System:
    return system_of(
        """
        system: robot
        namespace: lab
        nodes:
          motor: {lifecycle: {depends_on: [sensor]}}
          sensor: {}
          spare: {lifecycle: {autostart: unconfigured}}
        """
    )


@pytest.mark.parametrize(
    ("goals", "text"),
    [
        ({"motor": ACTIVE, "sensor": ACTIVE, "spare": UNCONFIGURED}, "3 running active"),
        ({"motor": INACTIVE, "sensor": INACTIVE, "spare": UNCONFIGURED}, "3 running inactive"),
        (dict.fromkeys(("motor", "sensor", "spare"), UNCONFIGURED), "3 running unconfigured"),
        (
            {"motor": ACTIVE, "sensor": INACTIVE, "spare": UNCONFIGURED},
            "3 running active /lab/sensor=inactive",
        ),
        ({"motor": ACTIVE}, "3 running active"),
    ],
)
def test_the_text_names_the_nodes_that_differ_from_a_start(
    robot: System, goals: dict[str, PrimaryState], text: str
) -> None:
    made = system_goals(robot, goals, "running", serial=3)
    assert str(made) == text
    assert parse_goals(text) == made
    states = made.states(robot)
    assert goals.items() <= states.items()


def test_nodes_that_the_system_does_not_have_any_more_are_left_out(robot: System) -> None:
    goals = SystemGoals(1, "running", ACTIVE, {"/lab/gone": INACTIVE})
    assert goals.states(robot) == start_goals(robot, ACTIVE)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1",
        "1 running",
        "x running active",
        "1 running on",
        "1 running active /a",
        "1 b c d=e=f",
    ],
)
def test_a_text_of_another_version_has_no_goals(text: str) -> None:
    assert parse_goals(text) is None
