"""Of a requested transition and a fault, a plan or a command, the later one wins."""

from __future__ import annotations

import pytest

from composer.model import System
from composer.plan import DesiredState, Fault, FaultKind, Restart, desired_states, reconcile
from tests.unit.support.plans import ACTIVE, INACTIVE, UNCONFIGURED
from tests.unit.support.resolving import system_of

ALL_ACTIVE = {"sensor": ACTIVE, "planner": ACTIVE, "motor": ACTIVE}


@pytest.fixture(scope="module")
def robot() -> System:
    return system_of(
        """
        system: robot
        nodes:
          motor: {lifecycle: {depends_on: [planner]}}
          planner: {lifecycle: {depends_on: [sensor]}}
          sensor: {}
        """
    )


def fault(node: str, serial: int, kind: FaultKind = FaultKind.SILENCE) -> Fault:
    return Fault(node, kind, "silent", serial)


def test_an_external_transition_outdates_earlier_faults_of_the_node() -> None:
    desired = DesiredState(ALL_ACTIVE)
    noticed = fault("sensor", desired.serial)
    moved = desired.move("sensor", INACTIVE)
    assert moved.fail(noticed) == moved
    assert moved.fail(fault("sensor", moved.serial)).down == {"sensor": "silent"}
    assert moved.fail(fault("planner", desired.serial)).down == {"planner": "silent"}
    hangs = fault("sensor", 0, FaultKind.LOST)
    assert moved.fail(hangs).down == {"sensor": "silent"}, "whatever moved it"


def test_goals_do_not_replace_those_of_later_external_transitions() -> None:
    before = DesiredState(ALL_ACTIVE)
    desired = before.move("motor", INACTIVE)
    down = dict.fromkeys(ALL_ACTIVE, UNCONFIGURED)
    assert desired.with_goals(down, before.serial).goals == {**down, "motor": INACTIVE}
    assert desired.with_goals(down, desired.serial).goals == down


def test_a_dependent_that_is_activated_on_request_stays_active(robot: System) -> None:
    desired = DesiredState(ALL_ACTIVE).fail(fault("sensor", 0))
    paused = {"sensor": UNCONFIGURED, "planner": INACTIVE, "motor": INACTIVE}
    assert desired_states(robot, desired) == paused
    moved = desired.move("motor", ACTIVE)
    assert desired_states(robot, moved) == {**paused, "motor": ACTIVE}
    again = moved.release("sensor").fail(fault("sensor", moved.serial))
    assert desired_states(robot, again) == paused, "it fails after the requested transition"


def test_no_restart_is_scheduled_for_a_node_that_was_moved_on_request() -> None:
    failed = DesiredState(ALL_ACTIVE).fail(fault("sensor", 0))
    restart = Restart("sensor", 1, due_s=1.0)
    assert failed.schedule(restart).next_restart == restart
    assert failed.move("sensor", INACTIVE).schedule(restart).next_restart is None


def test_an_outdated_fault_does_not_hide_a_later_one() -> None:
    first = DesiredState(ALL_ACTIVE).break_down("sensor")
    second = first.move("sensor", INACTIVE).break_down("sensor")
    assert second.fail(fault("sensor", first.serial)) == second
    assert second.unhandled == {"sensor": second.serial}
    failed = second.fail(fault("sensor", second.serial, FaultKind.TRANSITION))
    assert (failed.unhandled, failed.down) == ({}, {"sensor": "silent"})


def test_no_node_is_activated_before_a_dependency_in_a_transition(robot: System) -> None:
    states = {"sensor": ACTIVE, "motor": INACTIVE}  # the planner is in a transition
    assert reconcile(robot, DesiredState(ALL_ACTIVE), states, "").steps == ()
