"""When failed nodes are restarted, what else a failure does, and when a start is over."""

from __future__ import annotations

import pytest

from composer.model import OnFailure
from composer.plan import (
    Condition,
    DesiredState,
    Fault,
    FaultKind,
    Restart,
    conditions,
    decide,
    is_nothing_left,
    is_settled,
    optional_nodes,
    reconcile,
)
from tests.unit.support.plans import fault, robot, states, steps

NOW_S = 100.0
SHUTTING_DOWN = "shutting down the system"


def test_restarts_are_due_in_the_order_of_their_times() -> None:
    late, soon = Restart("sensor", 1, due_s=102.0), Restart("planner", 1, due_s=101.0)
    desired = DesiredState(states("aaaaa")).fail(fault("sensor")).fail(fault("planner"))
    assert desired.next_restart is None
    desired = desired.schedule(late).schedule(soon)
    assert desired.next_restart == soon
    desired = desired.restart("planner", at_s=101.0)
    assert desired.next_restart == late
    assert desired.release("sensor").next_restart is None, "a requested transition came first"


BUDGET = "max_attempts: 3, window_ms: 10000, backoff_ms: 100, then: shutdown"


@pytest.mark.parametrize(
    ("budget", "restarts", "action", "wait_s", "attempt"),
    [
        (BUDGET, (), OnFailure.RESTART, 0.1, 1),
        (BUDGET, (95.0,), OnFailure.RESTART, 0.2, 2),
        (BUDGET, (95.0, 96.0), OnFailure.RESTART, 0.4, 3),
        (BUDGET, (95.0, 96.0, 97.0), OnFailure.SHUTDOWN, 0.0, 0),
        (BUDGET, (80.0, 85.0, 89.9), OnFailure.RESTART, 0.1, 1),  # forgotten
        (BUDGET, (80.0, 96.0, 97.0), OnFailure.RESTART, 0.4, 3),
        # a node without restarts left is given up alone unless "then" is shutdown
        ("max_attempts: 1", (97.0,), OnFailure.ISOLATE, 0.0, 0),
        ("max_attempts: 1, then: isolate", (97.0,), OnFailure.ISOLATE, 0.0, 0),
        ("max_attempts: 1, then: shutdown", (97.0,), OnFailure.SHUTDOWN, 0.0, 0),
    ],
)
def test_the_budget(
    budget: str, restarts: tuple[float, ...], action: OnFailure, wait_s: float, attempt: int
) -> None:
    system = robot(f"{{on_failure: restart, restart: {{{budget}}}}}")
    desired = DesiredState(states("aaaaa"), restarts={"sensor": restarts})
    decision = decide(system, desired, fault("sensor"), NOW_S)
    assert decision is not None
    assert (decision.action, decision.wait_s, decision.attempt) == (action, wait_s, attempt)
    assert decision.condition == ("restarting" if attempt else "given up")
    if budget == BUDGET and not attempt:
        assert decision.reason == "silent for 300 ms; restarted 3 times within 10 s before"


@pytest.mark.parametrize(
    ("policy", "kind", "action", "condition", "consequence"),
    [
        ("isolate", FaultKind.SILENCE, OnFailure.ISOLATE, "isolated", "isolating it"),
        ("isolate", FaultKind.LOST, OnFailure.ISOLATE, "isolated", "isolating it"),
        ("isolate", FaultKind.ABSENT, OnFailure.ISOLATE, "absent", "waiting for it"),
        ("shutdown", FaultKind.TRANSITION, OnFailure.SHUTDOWN, "isolated", SHUTTING_DOWN),
        ("shutdown", FaultKind.ABSENT, OnFailure.SHUTDOWN, "isolated", SHUTTING_DOWN),
        ("restart", FaultKind.CALLBACK, OnFailure.RESTART, "restarting", "restart 1 in 0.5 s"),
        ("restart", FaultKind.REPORTED, OnFailure.RESTART, "restarting", "restart 1 in 0.5 s"),
        ("restart", FaultKind.ABSENT, OnFailure.ISOLATE, "absent", "waiting for it"),
        ("restart", FaultKind.LOST, OnFailure.ISOLATE, "given up", "giving it up"),
        ("restart, restart: {then: shutdown}", FaultKind.LOST, OnFailure.SHUTDOWN, "given up",
         SHUTTING_DOWN),
        ("ignore", FaultKind.STEP, OnFailure.IGNORE, "failure ignored", "ignoring it"),
        ("ignore", FaultKind.ABSENT, OnFailure.IGNORE, "failure ignored", "ignoring it"),
        ("ignore", FaultKind.LOST, OnFailure.ISOLATE, "isolated", "isolating it"),
        ("isolate", FaultKind.FINISHED, OnFailure.ISOLATE, "finished", "isolating it"),
        ("shutdown", FaultKind.FINISHED, OnFailure.SHUTDOWN, "finished", SHUTTING_DOWN),
        ("restart", FaultKind.FINISHED, OnFailure.RESTART, "restarting", "restart 1 in 0.5 s"),
        ("ignore", FaultKind.FINISHED, OnFailure.IGNORE, "failure ignored", "ignoring it"),
    ],
)  # fmt: skip
def test_policies(
    policy: str, kind: FaultKind, action: OnFailure, condition: str, consequence: str
) -> None:
    system = robot(f"{{on_failure: {policy}}}")
    decision = decide(system, DesiredState(states("aaaaa")), fault("sensor", kind=kind), NOW_S)
    assert decision is not None
    assert (decision.action, decision.condition) == (action, condition)
    assert decision.consequence == consequence
    hangs = "; it cannot be restarted" * (kind is FaultKind.LOST and condition == "given up")
    assert decision.reason == f"silent for 300 ms{hangs}"


def test_a_node_that_is_not_required_never_ends_the_system() -> None:
    system = robot("{on_failure: shutdown}", camera="{required: false}")
    desired = DesiredState(states("aaaaa"))
    for node, action in (("camera", OnFailure.ISOLATE), ("sensor", OnFailure.SHUTDOWN)):
        decision = decide(system, desired, fault(node), NOW_S)
        assert decision is not None
        assert decision.action is action


def test_an_ignored_failure_moves_no_node() -> None:
    system = robot("{on_failure: ignore}")
    desired = DesiredState(states("aaaaa")).tolerate(fault("sensor"))
    assert reconcile(system, desired, states("uaaaa"), "").steps == (), "nor is it brought up"
    plan = reconcile(system, desired, states("uiiaa"), "resumed")
    assert steps(plan) == ["activate planner", "activate motor"]
    assert decide(system, desired, fault("sensor"), NOW_S) is None, "it is reported once"
    again = Fault("sensor", FaultKind.SILENCE, "silent for 900 ms", serial=0)
    assert decide(system, desired, again, NOW_S) is not None
    released = desired.release("sensor")
    assert len(reconcile(system, released, states("uaaaa"), "").steps) == 2


def test_what_users_read_about_nodes_that_are_not_up() -> None:
    system = robot()
    desired = DesiredState(states("aaaaa")).fail(fault("sensor"), Condition.ABSENT)
    desired = desired.tolerate(fault("camera"))
    assert conditions(system, desired, states("uiiau"), ()) == {
        "sensor": "absent",
        "planner": "waiting for /sensor",
        "motor": "waiting for /planner",
        "camera": "failure ignored",
    }
    desired = DesiredState(states("aaaaa"))
    without_sensor = {name: at for name, at in states("aiiaa").items() if name != "sensor"}
    assert conditions(system, desired, without_sensor, ("sensor",)) == {
        "sensor": "starting",
        "planner": "waiting for /sensor",
        "motor": "waiting for /planner",
    }
    assert conditions(system, DesiredState(states("aaaia")), states("aaaia"), ()) == {}


@pytest.mark.parametrize(
    ("scheduled", "moving", "restarts", "is_over"),
    [
        ((), (), 0, True),
        (("sensor",), (), 0, False),
        ((), ("sensor",), 1, False),
        (("sensor",), (), 2, True),  # it has had its restarts
        (("camera",), ("camera",), 0, True),  # not required
    ],
)
def test_a_start_is_over_once_no_required_node_is_on_its_way(
    scheduled: tuple[str, ...], moving: tuple[str, ...], restarts: int, is_over: bool
) -> None:
    policy = "{on_failure: restart, restart: {max_attempts: 2}}"
    system = robot(policy, camera="{required: false}")
    desired = DesiredState(
        states("aaaaa"),
        scheduled={name: Restart(name, 1, 101.0) for name in scheduled},
        restarts={"sensor": (1.0,) * restarts},
    )
    assert is_settled(system, desired, moving) is is_over


@pytest.mark.parametrize(
    ("down", "condition", "is_over"),
    [
        (("planner", "sensor", "camera"), Condition.ISOLATED, True),
        (("planner", "sensor", "camera"), Condition.GIVEN_UP, True),
        (("planner", "sensor", "camera"), Condition.RESTARTING, False),
        (("planner", "sensor", "camera"), Condition.ABSENT, False),
        (("sensor", "camera"), Condition.ISOLATED, False),  # the logger goes on
        ((), Condition.ISOLATED, False),
    ],
)
def test_nothing_is_left_if_all_nodes_failed_or_depend_on_one(
    down: tuple[str, ...], condition: Condition, is_over: bool
) -> None:
    desired = DesiredState(states("aaaaa"))
    for name in down:
        desired = desired.fail(fault(name), condition)
    assert is_nothing_left(robot(), desired) is is_over


def test_nodes_without_which_a_system_is_up() -> None:
    assert optional_nodes(robot()) == frozenset()
    system = robot(sensor="{required: false}")
    assert optional_nodes(system) == {"sensor", "planner", "motor", "logger"}


def test_an_isolated_node_stays_down_and_the_others_go_on() -> None:
    system = robot("{on_failure: isolate}")
    desired = DesiredState(states("aaaaa")).fail(fault("planner"))
    plan = reconcile(system, desired, states("auaaa"), "")
    assert str(plan).splitlines() == [
        "#1 deactivate /motor: it needs planner, which is down",
        "#2 deactivate /logger: it needs planner, which is down",
    ]
    assert reconcile(system, desired, states("auiia"), "").steps == ()
    up = reconcile(system, desired.release("planner"), states("auiia"), "by hand")
    assert [step.node for step in up.steps] == ["planner", "planner", "logger", "motor"]
