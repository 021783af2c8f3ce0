"""What is requested of a system, as the processes of the system keep it."""

from __future__ import annotations

import pytest

from composer.model import PrimaryState, System
from composer.plan import SystemGoals, start_goals, system_goals
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
    ("goals", "limit", "others"),
    [
        ({"motor": ACTIVE, "sensor": ACTIVE, "spare": UNCONFIGURED}, ACTIVE, {}),
        ({"motor": INACTIVE, "sensor": INACTIVE, "spare": UNCONFIGURED}, INACTIVE, {}),
        (dict.fromkeys(("motor", "sensor", "spare"), UNCONFIGURED), UNCONFIGURED, {}),
        (
            {"motor": ACTIVE, "sensor": INACTIVE, "spare": UNCONFIGURED},
            ACTIVE,
            {"/lab/sensor": INACTIVE},
        ),
        ({"motor": ACTIVE}, ACTIVE, {}),
    ],
)
def test_goals_name_the_nodes_that_differ_from_a_start(
    robot: System,
    goals: dict[str, PrimaryState],
    limit: PrimaryState,
    others: dict[str, PrimaryState],
) -> None:
    made = system_goals(robot, goals, "running", serial=3)
    assert made == SystemGoals(3, "running", limit, others)
    states = made.states(robot)
    assert goals.items() <= states.items()


def test_nodes_that_the_system_does_not_have_any_more_are_left_out(robot: System) -> None:
    goals = SystemGoals(1, "running", ACTIVE, {"/lab/gone": INACTIVE})
    assert goals.states(robot) == start_goals(robot, ACTIVE)
