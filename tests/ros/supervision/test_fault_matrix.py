"""Every fault in every callback: the node's state, its log, and the nodes that are not affected.

The nodes run in a process of their own; this test requests everything that happens. Each hanging
node has an executor of its own: other nodes of its executor are blocked until it is interrupted.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from std_msgs.msg import Int64, String
from std_srvs.srv import Trigger

from tests.ros.support.faulty_system import (
    CALLBACKS,
    FAULTS,
    HANGING,
    METRONOME,
    PLACES,
    TRANSITIONS,
    write_faulty_system,
)
from tests.ros.support.in_process import Peer, finished, wait_until
from tests.ros.support.system_process import RunningSystem

#: The start and goal state of each transition.
GOALS = {
    "configure": ("unconfigured", "inactive"),
    "activate": ("inactive", "active"),
    "deactivate": ("active", "inactive"),
    "cleanup": ("inactive", "unconfigured"),
    "shutdown": ("inactive", "finalized"),
    "error": ("unconfigured", "unconfigured"),
}
#: The next transition from one primary state to another.
STEPS = {
    ("unconfigured", "inactive"): "configure",
    ("unconfigured", "active"): "configure",
    ("inactive", "active"): "activate",
    ("active", "inactive"): "deactivate",
    ("active", "unconfigured"): "deactivate",
    ("inactive", "unconfigured"): "cleanup",
}
CONTROL = "/control"  # the namespace of the metronome alone, in another process
ENOUGH_BEATS = 80  # so that one beat is well below the 5 %
ATTEMPTS = 3
RAISED, EXITED = "ValueError: broken", "SystemExit: out"
NONSENSE = "returned 'nonsense'"


@dataclass(frozen=True)
class Expected:
    """The response, the state after it, and a line of the node's log."""

    answer: object
    state: str
    log: str | None = None


def expected(place: str, fault: str) -> Expected:
    """Return the row of the table."""
    if place in TRANSITIONS:
        well = GOALS[place][1]
        failed = "finalized" if place == "error" else "unconfigured"
        log = {"raise": RAISED, "once": RAISED, "exit": EXITED, "nonsense": NONSENSE}
        if fault == "none":
            return Expected(place != "error", well)
        return Expected(False, failed, log.get(fault, "CallbackInterrupted"))
    if fault == "hang":
        state, log_line = "unconfigured", "CallbackInterrupted: the callback took too long"
    else:
        state, log_line = "active", {"raise": RAISED, "once": RAISED, "exit": EXITED}.get(fault, "")
    answer: object = None
    if place == "ask":
        returned = {"none": "None", "nonsense": "'nonsense'"}.get(fault)
        if returned is not None:
            log_line = f"returned {returned}, not a Trigger.Response"
        answer = (False, f"on_ask{': ' if returned is None else ' '}{log_line}")
    if place == "drive":
        log_line = NONSENSE if fault == "nonsense" else log_line
        answer = GoalStatus.STATUS_SUCCEEDED if fault == "none" else GoalStatus.STATUS_ABORTED
    return Expected(answer, state, log_line or None)


class Subject:
    """One faulty node, through its ROS interfaces."""

    def __init__(self, peer: Peer, name: str) -> None:
        self.name = name
        self._peer = peer

    @cached_property
    def _drive(self) -> Any:
        return self._peer.action_client(Navigate, f"/{self.name}/drive")

    @cached_property
    def _input(self) -> Any:
        return self._peer.publisher(String, f"/{self.name}/input")

    @property
    def state(self) -> str:
        return self._peer.state(f"/{self.name}")

    def set_fault(self, fault: str) -> None:
        assert self._peer.set_parameter(f"/{self.name}", "fault", fault) == ""

    def go_to(self, goal: str) -> None:
        """Take the node to a state."""
        while (state := self.state) != goal:
            assert self._peer.change(f"/{self.name}", STEPS[state, goal]), (self.name, state, goal)

    def trigger(self, place: str) -> Any:
        """Trigger the callback; return the future of the response, if there is one."""
        if place in TRANSITIONS:
            transition = "configure" if place == "error" else place
            return self._peer.begin_change(f"/{self.name}", transition)
        if place == "ask":
            return self._peer.begin(Trigger, f"/{self.name}/ask")
        if place == "drive":
            send = partial(self._drive.send_goal_async, Navigate.Goal())
            goal = finished(self._peer.run(send))
            return self._peer.run(goal.get_result_async)
        if place == "input":
            self._input.publish(String())
        return None  # the timer is called anyway, and so is on_parameters


def answer_of(place: str, future: Any) -> object:
    if future is None:
        return None
    answer = finished(future)
    if place == "ask":
        return answer.success, answer.message
    return answer.status if place == "drive" else answer.success


class Metronomes:
    """Compares the beats of a node that must not be affected with those in the other system.

    Both are counted at the same time, so that the load of the machine affects both. Times in which
    nodes are created again are excluded: Fast DDS blocks Python for tens of milliseconds for each.
    """

    def __init__(self, peer: Peer) -> None:
        self._beats = {"/beat": 0, f"{CONTROL}/beat": 0}
        self._received = set[str]()
        self._counts = False
        for topic in self._beats:
            peer.node.create_subscription(Int64, topic, partial(self._on_beat, topic), 10)
        wait_until(lambda: len(self._received) == len(self._beats), "beats of both")

    def are_equal_during(self, act: Callable[[], None]) -> bool:
        """Act, and count until there are enough beats; return whether there are as many of both."""
        self._beats = dict.fromkeys(self._beats, 0)
        self._counts = True
        act()
        wait_until(lambda: self._beats[f"{CONTROL}/beat"] >= ENOUGH_BEATS)
        self._counts = False
        overload = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
        ratio = self._beats["/beat"] / self._beats[f"{CONTROL}/beat"]
        return ratio > 1.0 - 0.05 * overload

    def _on_beat(self, topic: str, _: Int64) -> None:
        self._received.add(topic)
        if self._counts:
            self._beats[topic] += 1


def check(system: RunningSystem, subject: Subject, place: str, fault: str, future: Any) -> None:
    """Check the effects of a fault against the table."""
    row = expected(place, fault)
    where = f"{subject.name}: {place} {fault}"
    assert answer_of(place, future) == row.answer, where
    system.wait_for(rf"\[{subject.name}\] {place} acts$")
    if row.log is not None:
        system.wait_for(rf"\[{subject.name}\] on_{place}: .*{re.escape(row.log)}")
    wait_until(lambda: subject.state == row.state, f"{where}: {row.state}")


def fail(system: RunningSystem, subject: Subject, place: str) -> None:
    """Make one callback of a node fail as the node's name says, and check the effects."""
    subject.go_to(GOALS[place][0] if place in GOALS else "active")
    subject.set_fault(f"{place} {subject.name}")
    check(system, subject, place, subject.name, subject.trigger(place))
    if subject.name == "once" and place != "error":
        retry(system, subject, place)
    subject.set_fault("")


def retry(system: RunningSystem, subject: Subject, place: str) -> None:
    """Check that a callback that has failed once works the next time."""
    start = GOALS[place][0] if place in GOALS else "active"
    subject.set_fault("")
    subject.go_to(start)
    subject.set_fault(f"{place} once")
    answer = answer_of(place, subject.trigger(place))
    system.wait_for(rf"\[once\] {place} works again$")
    well = {"ask": (True, ""), "drive": GoalStatus.STATUS_SUCCEEDED}
    assert answer == well.get(place, True if place in TRANSITIONS else None), place
    wait_until(lambda: subject.state == (GOALS[place][1] if place in GOALS else "active"))


def hang(system: RunningSystem, hanging: Mapping[str, Subject]) -> None:
    """Make a callback of each node hang, all at the same time."""
    for place, subject in hanging.items():
        subject.go_to(GOALS[place][0] if place in GOALS else "active")
    futures = {}
    for place, subject in hanging.items():
        subject.set_fault(f"{place} hang")
        futures[place] = subject.trigger(place)
    for place, subject in hanging.items():
        check(system, subject, place, "hang", futures[place])
        system.wait_for(rf"/hang_{place} is stuck and did not return from on_{place} within")


def start_all(peer: Peer) -> None:
    answer = peer.call(Trigger, "/faulty/manager/startup")
    assert answer.success, answer.message


def fail_everywhere(
    system: RunningSystem, peer: Peer, metronomes: Metronomes, is_again: bool
) -> bool:
    """Make all callbacks of all nodes fail; return whether that has affected no metronome."""
    subjects = [Subject(peer, name) for name in FAULTS if not (is_again and name == "once")]

    def fail_and_return() -> None:
        for place in (*CALLBACKS, "configure", "activate", "deactivate", "cleanup", "error"):
            for subject in subjects:
                fail(system, subject, place)

    def go_down() -> None:
        for subject in subjects:
            fail(system, subject, "shutdown")

    were_equal = metronomes.are_equal_during(fail_and_return)
    start_all(peer)  # creates the finalized nodes again
    were_equal = metronomes.are_equal_during(go_down) and were_equal
    recover(peer, subjects)
    return were_equal


def hang_everywhere(system: RunningSystem, peer: Peer, metronomes: Metronomes, _: bool) -> bool:
    """Make a callback of each node hang; return whether that has affected no metronome."""
    hanging = {place: Subject(peer, f"hang_{place}") for place in PLACES}
    were_equal = metronomes.are_equal_during(lambda: hang(system, hanging))
    recover(peer, hanging.values())
    return were_equal


def recover(peer: Peer, subjects: Iterable[Subject]) -> None:
    """Start the system again, with nodes that do not fail, and check that all are active."""
    for subject in subjects:
        if subject.state != "finalized":
            subject.set_fault("")
    start_all(peer)
    assert {subject.state for subject in subjects} == {"active"}


# Each in a system of its own: one with all nodes has too many to be destroyed within two seconds
# on a busy machine.
@pytest.mark.parametrize(
    ("names", "act"), [(FAULTS, fail_everywhere), (HANGING, hang_everywhere)], ids=["fail", "hang"]
)
def test_every_fault_in_every_callback(
    tmp_path: Path, peer: Peer, names: tuple[str, ...], act: Callable[..., bool]
) -> None:
    path = write_faulty_system(tmp_path, names)
    alone = tmp_path / "alone.yaml"
    alone.write_text(METRONOME, encoding="utf-8")
    with (
        RunningSystem(str(alone), "--autostart", "active", "--namespace", CONTROL) as control,
        RunningSystem(str(path), "--autostart", "active", "--grace", "60") as system,
    ):
        for running in (control, system):
            running.wait_for("nodes active after")
        metronomes = Metronomes(peer)
        # Something else may stop one of the two processes for a moment.
        assert any(act(system, peer, metronomes, attempt > 0) for attempt in range(ATTEMPTS))
        assert system.stop()[0] == 0, "all failed nodes have recovered"
    for place in PLACES if "raise" in names else ():
        line = system.lines.index(system.wait_for(rf"\[raise\] on_{place}: {RAISED}"))
        assert system.lines[line + 1].lstrip() == "Traceback (most recent call last):", place
