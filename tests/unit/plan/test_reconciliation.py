"""What is done about a failed node, by tables: no ROS, no clock, no thread."""

from __future__ import annotations

import pytest

from composer.model import OnFailure, PrimaryState, System
from composer.plan import (
    Decision,
    DesiredState,
    Fault,
    FaultKind,
    decide,
    desired_states,
    reconcile,
)
from tests.unit.support.resolving import system_of

ACTIVE = PrimaryState.ACTIVE
LETTERS = {"u": PrimaryState.UNCONFIGURED, "i": PrimaryState.INACTIVE, "a": ACTIVE}
NOW_S = 100.0
NAMES = ("sensor", "planner", "motor", "logger", "camera")


SHUTTING_DOWN = "shutting down the system"


def robot(
    lifecycle: str = "{on_failure: restart}", sensor: str = "{}", camera: str = "{}"
) -> System:
    return system_of(
        f"""
        system: robot
        lifecycle: {lifecycle}
        nodes:
          logger: {{lifecycle: {{depends_on: {{planner: inactive}}}}}}
          motor: {{lifecycle: {{depends_on: [planner]}}}}
          planner: {{lifecycle: {{depends_on: [sensor]}}}}
          sensor: {sensor}
          camera: {camera}
        """
    )


def states(letters: str) -> dict[str, PrimaryState]:
    return {name: LETTERS[letter] for name, letter in zip(NAMES, letters, strict=True)}


def fault(node: str, kind: FaultKind = FaultKind.SILENCE) -> Fault:
    return Fault(node, kind, "silent for 300 ms", serial=0)


@pytest.mark.parametrize(
    ("down", "goals"),
    [
        ((), "aaaaa"),
        (("sensor",), "uiiaa"),  # the logger can do with an inactive planner
        (("planner",), "auiia"),
        (("motor",), "aauaa"),
        (("camera",), "aaaau"),
        (("sensor", "camera"), "uiiau"),
        (("planner", "sensor"), "uuiia"),
    ],
)
def test_where_nodes_are_wanted_while_some_are_held_down(down: tuple[str, ...], goals: str) -> None:
    desired = DesiredState(states("aaaaa"), dict.fromkeys(down, "silent"))
    assert desired_states(robot(), desired) == states(goals)


def test_a_fault_raises_the_desired_state_of_no_other_node() -> None:
    desired = DesiredState(states("aiuii"), {"sensor": "silent"})
    assert desired_states(robot(), desired) == states("uiuii")


DOWN = [
    "#1 deactivate /motor: it needs sensor, which is down",
    "#2 deactivate /planner after #1: it needs sensor, which is down",
    "#3 deactivate /sensor after #2: silent for 300 ms",
    "#4 cleanup /sensor: silent for 300 ms",
]
UP = [
    "#1 configure /sensor: restart 1 of 5",
    "#2 activate /sensor: restart 1 of 5",
    "#3 activate /planner after #2: restart 1 of 5",
    "#4 activate /motor after #3: restart 1 of 5",
]


def test_dependents_pause_before_a_restart_and_resume_behind_it() -> None:
    system = robot()
    desired = DesiredState(states("aaaaa"))
    decision = decide(system, desired, fault("sensor"), NOW_S)
    assert decision == Decision(OnFailure.RESTART, "silent for 300 ms", wait_s=0.5, attempt=1)

    desired = desired.fail(fault("sensor"))
    assert str(reconcile(system, desired, states("aaaaa"), "")).splitlines() == DOWN

    desired = desired.restart("sensor", at_s=100.5)
    assert desired.down == {}
    assert desired.restarts == {"sensor": (100.5,)}
    assert str(reconcile(system, desired, states("uiiaa"), "restart 1 of 5")).splitlines() == UP


def test_a_node_that_a_user_deactivated_stays_inactive() -> None:
    system = robot()
    desired = (
        DesiredState(states("aaaaa"))
        .with_goals({"motor": PrimaryState.INACTIVE})
        .fail(fault("sensor"))
    )
    down = reconcile(system, desired, states("aaiaa"), "")
    assert [step.node for step in down.steps] == ["planner", "sensor", "sensor"]
    up = reconcile(system, desired.restart("sensor", 100.5), states("uiiaa"), "restart")
    assert [step.node for step in up.steps] == ["sensor", "sensor", "planner"]


def test_no_node_is_activated_before_a_dependency_that_a_user_deactivated() -> None:
    system = robot()
    desired = DesiredState(states("aiaaa"))
    assert reconcile(system, desired, states("aiaaa"), "").steps == (), "no node is taken down"
    plan = reconcile(system, desired, states("aiuua"), "")
    assert [f"{step.transition} {step.node}" for step in plan.steps] == [
        "configure logger",
        "configure motor",
        "activate logger",
    ]


@pytest.mark.parametrize(
    ("here", "goal", "steps"),
    [
        ("ui", "aa", []),
        ("uu", "aa", []),
        ("au", "aa", ["configure viewer", "activate viewer"]),
        ("iu", "ia", []),
        ("iu", "ii", ["configure viewer"]),
    ],
)
def test_a_class_is_not_configured_before_what_it_depends_on(
    here: str, goal: str, steps: list[str]
) -> None:
    system = system_of(
        """
        system: robot
        nodes:
          sensor: {}
          viewer: {class: "viewer:Viewer", lifecycle: {depends_on: [sensor]}}
        """
    )
    at, goals = (
        {name: LETTERS[letter] for name, letter in zip(("sensor", "viewer"), text, strict=True)}
        for text in (here, goal)
    )
    desired = DesiredState(goals)
    if at["sensor"] is PrimaryState.UNCONFIGURED:
        desired = desired.fail(fault("sensor"))
    plan = reconcile(system, desired, at, "")
    assert [f"{step.transition} {step.node}" for step in plan.steps] == steps


@pytest.mark.parametrize(
    ("here", "goal", "down", "steps"),
    [
        (
            *("uuu", "aaa", ""),
            "configure box, activate box, configure camera, configure viewer, activate camera,"
            " activate viewer",
        ),
        (
            *("aaa", "uuu", ""),
            "deactivate viewer, deactivate camera, cleanup viewer, cleanup camera, deactivate box,"
            " cleanup box",
        ),
        (
            "aaa",
            "aaa",
            "box",
            "deactivate viewer, deactivate camera, cleanup camera, deactivate box",
        ),
        (
            "aaa",
            "aaa",
            "sensor",
            "deactivate viewer, deactivate camera, cleanup camera, deactivate",
        ),
        ("iuu", "iaa", "", "configure viewer"),
        ("aaa", "aaa", "camera", "deactivate viewer, deactivate camera, cleanup camera"),
    ],
)
def test_a_component_is_loaded_while_its_container_is_active(
    here: str, goal: str, down: str, steps: str
) -> None:
    system = system_of(
        """
        system: robot
        nodes:
          viewer: {lifecycle: {depends_on: [camera]}}
          camera:
            component: {package: demo, plugin: "demo::Camera", lifecycle: managed}
            container: box
          box: {external: true, lifecycle: {depends_on: [sensor]}}
          sensor: {}
        """
    )
    at, goals = (
        {
            name: LETTERS[letter]
            for name, letter in zip(("box", "camera", "viewer"), text, strict=True)
        }
        | {"sensor": ACTIVE}
        for text in (here, goal)
    )
    desired = DesiredState(goals)
    if down:
        desired = desired.fail(fault(down))
    plan = ", ".join(
        f"{step.transition} {step.node}" for step in reconcile(system, desired, at, "").steps
    )
    assert plan.startswith(steps)
    if not down:
        assert plan == steps


def test_a_second_fault_of_a_failed_node_is_ignored() -> None:
    desired = DesiredState(states("aaaaa")).fail(fault("sensor"))
    assert decide(robot(), desired, fault("sensor"), NOW_S) is None
    assert decide(robot(), desired, fault("camera"), NOW_S) is not None
    assert decide(robot(), desired, fault("missing"), NOW_S) is None


def test_two_nodes_that_fail_one_after_the_other_come_back_one_after_the_other() -> None:
    system = robot()
    desired = DesiredState(states("aaaaa")).fail(fault("sensor")).fail(fault("planner"))
    down = reconcile(system, desired, states("aaaaa"), "")
    assert [f"{step.transition} {step.node}" for step in down.steps] == [
        "deactivate motor",
        "deactivate logger",
        "deactivate planner",
        "deactivate sensor",
        "cleanup planner",
        "cleanup sensor",
    ]
    desired = desired.restart("planner", 101.0)
    up = reconcile(system, desired, states("uuiia"), "restart")
    assert [f"{step.transition} {step.node}" for step in up.steps] == [
        "configure planner",
        "activate logger",
    ]
    desired = desired.restart("sensor", 102.0)
    up = reconcile(system, desired, states("uiiaa"), "restart")
    assert [f"{step.transition} {step.node}" for step in up.steps][:2] == [
        "configure sensor",
        "activate sensor",
    ]
