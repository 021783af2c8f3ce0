"""From any states to any goals: down in reverse, then up in order, each step once."""

from __future__ import annotations

import itertools

import pytest

from composer.model import PrimaryState
from composer.plan import plan_transitions
from tests.unit.support.plans import states
from tests.unit.support.resolving import system_of

SYSTEM = system_of(
    """
    system: robot
    nodes:
      top: {lifecycle: {depends_on: [left, right]}}
      left: {lifecycle: {depends_on: [low]}}
      right: {lifecycle: {depends_on: {low: inactive}}}
      low: {}
    """
)
CAUSES = {node.name.value: "asked for" for node in SYSTEM.nodes}
NAMES = ("low", "left", "right", "top")


@pytest.mark.parametrize(
    ("here", "goal", "plan"),
    [
        ("uuuu", "uuuu", ""),
        ("aaaa", "aaaa", ""),
        (
            "uuuu",
            "aaaa",
            "#1 configure /low; #2 configure /left after #1; #3 configure /right after #1; "
            "#4 configure /top after #2 #3; #5 activate /low; #6 activate /left after #5; "
            "#7 activate /right; #8 activate /top after #6 #7",
        ),
        (
            "aaaa",
            "iiii",
            "#1 deactivate /top; #2 deactivate /right after #1; #3 deactivate /left after #1; "
            "#4 deactivate /low after #3",
        ),
        (
            "aaaa",
            "uiii",
            "#1 deactivate /top; #2 deactivate /right after #1; #3 deactivate /left after #1; "
            "#4 deactivate /low after #3; #5 cleanup /low",
        ),
        ("aaia", "aaaa", "#1 activate /right"),
        ("uiii", "aaaa", "#1 configure /low; #2 activate /low; #3 activate /left after #2; "
         "#4 activate /right; #5 activate /top after #3 #4"),
        ("a-aa", "iiii", "#1 deactivate /top; #2 deactivate /right after #1; #3 deactivate /low"),
        ("aaaa", "---u", "#1 deactivate /top; #2 cleanup /top"),
        ("uaaa", "aaau", "#1 deactivate /top; #2 cleanup /top; #3 configure /low; "
         "#4 activate /low"),
    ],
)  # fmt: skip
def test_plans(here: str, goal: str, plan: str) -> None:
    at, goals = states(here, NAMES), states(goal, NAMES)  # "aaii": low and left are active
    printed = str(plan_transitions(SYSTEM, at, goals, CAUSES))
    assert printed.replace(": asked for", "").replace("\n", "; ") == plan


ALL = ["".join(letters) for letters in itertools.product("uia", repeat=4)]


def test_every_goal_is_reached_from_everywhere_by_legal_steps() -> None:
    starts = {"configure": "u", "activate": "i", "deactivate": "a", "cleanup": "i"}
    ends = {"configure": "i", "activate": "a", "deactivate": "i", "cleanup": "u"}
    for here, goal in itertools.product(ALL, ALL):
        at = dict(zip(NAMES, here, strict=True))
        plan = plan_transitions(SYSTEM, states(here, NAMES), states(goal, NAMES), CAUSES)
        for number, step in enumerate(plan.steps, start=1):
            assert step.number == number
            assert at[step.node] == starts[step.transition]
            assert all(before < number for before in step.after)
            at[step.node] = ends[step.transition]
        assert "".join(at.values()) == goal
        steps = [(step.transition, step.node) for step in plan.steps]
        assert len(steps) == len(set(steps))


def test_a_class_is_configured_once_what_it_depends_on_is_active() -> None:
    system = system_of(
        """
        system: robot
        nodes:
          driver: {class: "driver:Driver"}
          filter: {lifecycle: {depends_on: [driver]}}
          viewer: {class: "viewer:Viewer", lifecycle: {depends_on: {filter: inactive}}}
          planner: {class: "planner:Planner", lifecycle: {depends_on: [filter]}}
          logger: {lifecycle: {depends_on: [planner]}}
        """
    )
    here = {node.name.value: PrimaryState.UNCONFIGURED for node in system.nodes}
    goals = dict.fromkeys(here, PrimaryState.ACTIVE)
    plan = plan_transitions(system, here, goals, dict.fromkeys(here, "asked for"))
    phases = [f"{phase[0].transition} {[step.node for step in phase]}" for phase in plan.phases]
    assert phases == [
        "configure ['driver', 'filter', 'viewer']",
        "activate ['driver', 'filter', 'viewer']",
        "configure ['planner', 'logger']",
        "activate ['planner', 'logger']",
    ]
    waits = {f"{step.transition} {step.node}": step.after for step in plan.steps}
    activated = {step.node: step.number for step in plan.steps if step.transition == "activate"}
    assert waits["configure planner"] == (activated["filter"],)
    here["planner"] = PrimaryState.INACTIVE
    plan = plan_transitions(system, here, goals, dict.fromkeys(here, "asked for"))
    activated = {step.node: step for step in plan.steps if step.transition == "activate"}
    assert activated["planner"].after == (activated["filter"].number,)
