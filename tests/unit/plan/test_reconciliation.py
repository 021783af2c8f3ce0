"""What is done about a failed node, by tables: no ROS, no clock, no thread."""

from __future__ import annotations

import pytest

from composer.model import OnFailure, PrimaryState
from composer.plan import Decision, DesiredState, decide, desired_states, reconcile
from tests.unit.support.plans import fault, robot, states, steps
from tests.unit.support.resolving import system_of

NOW_S = 100.0


@pytest.mark.parametrize(
    ("goals", "down", "wanted"),
    [
        ("aaaaa", (), "aaaaa"),
        ("aaaaa", ("sensor",), "uiiaa"),  # the logger can do with an inactive planner
        ("aaaaa", ("planner",), "auiia"),
        ("aaaaa", ("motor",), "aauaa"),
        ("aaaaa", ("camera",), "aaaau"),
        ("aaaaa", ("sensor", "camera"), "uiiau"),
        ("aaaaa", ("planner", "sensor"), "uuiia"),
        ("aiuii", ("sensor",), "uiuii"),  # a fault raises the desired state of no other node
    ],
)
def test_where_nodes_are_wanted_while_some_are_held_down(
    goals: str, down: tuple[str, ...], wanted: str
) -> None:
    desired = DesiredState(states(goals), dict.fromkeys(down, "silent"))
    assert desired_states(robot(), desired) == states(wanted)


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
    system, goals = robot(), {"motor": PrimaryState.INACTIVE}
    desired = DesiredState(states("aaaaa")).with_goals(goals).fail(fault("sensor"))
    down = reconcile(system, desired, states("aaiaa"), "")
    assert steps(down) == ["deactivate planner", "deactivate sensor", "cleanup sensor"]
    up = reconcile(system, desired.restart("sensor", 100.5), states("uiiaa"), "restart")
    assert steps(up) == ["configure sensor", "activate sensor", "activate planner"]


def test_no_node_is_activated_before_a_dependency_that_a_user_deactivated() -> None:
    system, desired = robot(), DesiredState(states("aiaaa"))
    assert reconcile(system, desired, states("aiaaa"), "").steps == (), "no node is taken down"
    plan = reconcile(system, desired, states("aiuua"), "")
    assert steps(plan) == ["configure logger", "configure motor", "activate logger"]


@pytest.mark.parametrize(
    ("here", "goal", "expected"),
    [
        ("ui", "aa", []),
        ("uu", "aa", []),
        ("au", "aa", ["configure viewer", "activate viewer"]),
        ("iu", "ia", []),
        ("iu", "ii", ["configure viewer"]),
    ],
)
def test_a_class_is_not_configured_before_what_it_depends_on(
    here: str, goal: str, expected: list[str]
) -> None:
    system = system_of(
        """
        system: robot
        nodes:
          sensor: {}
          viewer: {class: "viewer:Viewer", lifecycle: {depends_on: [sensor]}}
        """
    )
    at, goals = (states(letters, ("sensor", "viewer")) for letters in (here, goal))
    desired = DesiredState(goals)
    if at["sensor"] is PrimaryState.UNCONFIGURED:
        desired = desired.fail(fault("sensor"))
    assert steps(reconcile(system, desired, at, "")) == expected


@pytest.mark.parametrize(
    ("here", "goal", "down", "expected"),
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
            *("aaa", "aaa", "box"),
            "deactivate viewer, deactivate camera, cleanup camera, deactivate box",
        ),
        (
            *("aaa", "aaa", "sensor"),
            "deactivate viewer, deactivate camera, cleanup camera, deactivate",
        ),
        ("iuu", "iaa", "", "configure viewer"),
        ("aaa", "aaa", "camera", "deactivate viewer, deactivate camera, cleanup camera"),
    ],
)
def test_a_component_is_loaded_while_its_container_is_active(
    here: str, goal: str, down: str, expected: str
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
    names = ("sensor", "box", "camera", "viewer")
    at, goals = (states(f"a{letters}", names) for letters in (here, goal))
    desired = DesiredState(goals)
    if down:
        desired = desired.fail(fault(down))
    plan = ", ".join(steps(reconcile(system, desired, at, "")))
    assert plan.startswith(expected) if down else plan == expected


def test_a_second_fault_of_a_failed_node_is_ignored() -> None:
    desired = DesiredState(states("aaaaa")).fail(fault("sensor"))
    assert decide(robot(), desired, fault("sensor"), NOW_S) is None
    assert decide(robot(), desired, fault("camera"), NOW_S) is not None
    assert decide(robot(), desired, fault("missing"), NOW_S) is None
