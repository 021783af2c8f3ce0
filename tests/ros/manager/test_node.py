"""The system's own node: commands for the whole system, and how it tells what state it is in."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from composer.runtime.host import Host, HostOptions
from composer.runtime.process import StartRefused
from composer.runtime.ros.manager_protocol import STATE_QOS
from composer.runtime.supervision.events import RolledBack, RollingBack, StateChanged
from tests.ros.support.in_process import Peer, RunningSystem, running, system_of, wait_until

ROBOT = """
system: robot
namespace: fleet
nodes:
  motor: {lifecycle: {depends_on: [planner]}}
  planner: {behavior: planner:Planner, parameters: {fault: ""}}
  camera: {lifecycle: {autostart: inactive}}
"""
PLANNER = """
from composer.behavior import Behavior, TransitionFailed

class Planner(Behavior):
    def on_configure(self): self.check("configure")
    def on_activate(self): self.check("activate")
    def on_deactivate(self): self.check("deactivate")
    def check(self, name):
        if self.parameters.fault == name:
            raise ValueError("no map")
        if self.parameters.fault == f"refuse {name}":
            raise TransitionFailed("not now")
"""


def ask(peer: Peer, what: str, system: str = "/fleet/robot") -> tuple[bool, str]:
    answer = peer.call(Trigger, f"{system}/manager/{what}")
    return answer.success, answer.message


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {item.key: item.value for item in status.values}


def seconds(message: DiagnosticArray) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9)


def are_a_second_apart(messages: list[DiagnosticArray]) -> bool:
    """Say whether they were sent one a second; a machine that stands still disturbs a few."""
    times_s = [seconds(message) for message in messages]
    return all(0.8 < later_s - s < 1.2 for s, later_s in itertools.pairwise(times_s))


def latest(heard: list[Any]) -> dict[str, dict[str, str]]:
    """The values of the last message, by the name of what they tell of."""
    return {status.name: values(status) for status in heard[-1].status}


def test_a_system_is_paused_resumed_reset_and_started_from_outside(
    tmp_path: Path, peer: Peer
) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER) as system:
        assert ask(peer, "is_active") == (True, "2 of 3 nodes active")
        for what, message, states in (
            ("pause", "0 of 3 nodes active", ["/fleet/motor inactive", "/fleet/planner inactive"]),
            ("pause", "0 of 3 nodes active", []),
            ("resume", "2 of 3 nodes active", ["/fleet/planner active", "/fleet/motor active"]),
            (
                "reset",
                "0 of 3 nodes active",
                [
                    "/fleet/motor inactive",
                    "/fleet/planner inactive",
                    "/fleet/camera unconfigured",
                    "/fleet/motor unconfigured",
                    "/fleet/planner unconfigured",
                ],
            ),
            ("resume", "0 of 3 nodes active", []),
            (
                "startup",
                "2 of 3 nodes active",
                [
                    "/fleet/planner inactive",
                    "/fleet/camera inactive",
                    "/fleet/motor inactive",
                    "/fleet/planner active",
                    "/fleet/motor active",
                ],
            ),
            ("startup", "2 of 3 nodes active", []),
        ):
            before = len(system.told(StateChanged))
            assert ask(peer, what) == (True, message)
            moved = [str(event) for event in system.told(StateChanged)[before:]]
            assert sorted(moved) == sorted(states), what
            assert ask(peer, "is_active")[0] is (message.startswith("2")), what
        assert ask(peer, "shutdown")[0]
        assert system.end().exit_code == 0
    assert system.end().reason == "shutdown, asked for from outside"
    assert system.states()[-3:][0] in ("/fleet/camera finalized", "/fleet/motor finalized")


def test_a_system_is_not_active_when_a_node_fails_that_was_only_to_be_inactive(
    tmp_path: Path, peer: Peer
) -> None:
    camera = "camera: {behavior: planner:Planner, parameters: {fault: activate}, "
    with running(ROBOT.replace("camera: {", camera), tmp_path, planner=PLANNER):
        assert ask(peer, "is_active") == (True, "2 of 3 nodes active")
        assert not peer.change("/fleet/camera", "activate")
        wait_until(lambda: "/fleet/camera is down" in ask(peer, "is_active")[1], "it has failed")
        success, message = ask(peer, "is_active")
        assert not success
        assert message.startswith("2 of 3 nodes active, /fleet/camera is down: activate ended in")
        assert ask(peer, "startup") == (True, "2 of 3 nodes active")
        assert ask(peer, "is_active")[0]


def test_finalized_nodes_are_made_anew(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER):
        assert peer.change("/fleet/planner", "shutdown")
        assert not peer.change("/fleet/planner", "configure")
        success, message = ask(peer, "is_active")
        assert (success, message) == (False, "1 of 3 nodes active")
        finalized = peer.servers("/fleet/planner/get_state")
        assert ask(peer, "startup") == (True, "2 of 3 nodes active")
        wait_until(lambda: peer.servers("/fleet/planner/get_state") - finalized, "the new node")
        assert peer.state("/fleet/planner") == "active"
        assert peer.change("/fleet/planner", "deactivate")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("configure", "/fleet/planner: it did not configure: ValueError: no map"),
        ("refuse activate", "/fleet/planner: it did not activate: TransitionFailed: not now"),
    ],
)
def test_a_start_that_fails_is_undone_and_can_be_tried_again(
    tmp_path: Path, peer: Peer, fault: str, words: str
) -> None:
    with running(ROBOT, tmp_path, autostart=PrimaryState.UNCONFIGURED, planner=PLANNER) as system:
        assert peer.set_parameter("/fleet/planner", "fault", fault) == ""
        success, message = ask(peer, "startup")
        assert not success
        assert message.startswith(words)
        assert message.endswith("0 of 3 nodes active")
        for node in ("planner", "motor", "camera"):
            assert peer.state(f"/fleet/{node}") == "unconfigured"
        assert peer.set_parameter("/fleet/planner", "fault", "") == ""
        assert ask(peer, "startup") == (True, "2 of 3 nodes active")
        assert system.stop().exit_code == 0


def test_a_pause_that_fails_says_so(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER):
        assert peer.set_parameter("/fleet/planner", "fault", "refuse deactivate") == ""
        success, message = ask(peer, "pause")
        assert not success
        assert "/fleet/planner: it did not deactivate: TransitionFailed: not now" in message


def test_states_are_told_latched_on_change_and_every_second(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER):
        states = peer.listen(DiagnosticArray, "/fleet/robot/manager/state", STATE_QOS)
        wait_until(lambda: states, "the latched state")
        diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
        wait_until(lambda: len(diagnostics) >= 5, "messages at once, then one a second")
        wait_until(lambda: are_a_second_apart(diagnostics[-3:]), "one a second")
        told = latest(diagnostics)
        assert list(told) == [
            "robot", "robot: /fleet/planner", "robot: /fleet/motor", "robot: /fleet/camera",
        ]  # fmt: skip
        assert told["robot: /fleet/planner"]["state"] == "active"
        assert told["robot: /fleet/camera"]["state"] == "inactive"
        assert told["robot"]["activity"] == "running"
        assert diagnostics[-1].status[0].level == DiagnosticStatus.OK

        assert peer.set_parameter("/fleet/planner", "fault", "deactivate") == ""
        assert not peer.change("/fleet/planner", "deactivate")
        wait_until(
            lambda: latest(states)["robot: /fleet/motor"]["state"] == "inactive", "the new state"
        )
        # Held down is said of it when all that needs it has been moved.
        wait_until(lambda: latest(states)["robot: /fleet/planner"]["held_down"], "that it is down")
        told = latest(states)["robot: /fleet/planner"]
        assert told["state"] == "unconfigured"
        assert told["held_down"] == "deactivate ended in an error: ValueError: no map"
        assert told["last_error"] == "deactivate ended in an error: ValueError: no map"
        assert states[-1].status[0].level == DiagnosticStatus.ERROR
        assert "/fleet/planner is down" in states[-1].status[0].message


DIAMOND = """
system: diamond
lifecycle: {autostart: unconfigured}
nodes:
  top: {lifecycle: {depends_on: [left_3, right_3]}}
  left_3: {lifecycle: {depends_on: [left_2]}}
  left_2: {lifecycle: {depends_on: [middle]}}
  right_3: {lifecycle: {depends_on: [right_2]}}
  right_2: {lifecycle: {depends_on: [middle]}}
  middle:
    behavior: planner:Planner
    parameters: {fault: ""}
    lifecycle: {depends_on: [left, right]}
  left: {lifecycle: {depends_on: [left_0]}}
  right: {lifecycle: {depends_on: [low]}}
  left_0: {lifecycle: {depends_on: [low]}}
  low: {}
"""


def test_a_diamond_of_ten_with_a_failing_node_in_the_middle(tmp_path: Path, peer: Peer) -> None:
    with running(DIAMOND, tmp_path, planner=PLANNER) as system:
        assert peer.set_parameter("/middle", "fault", "activate") == ""
        success, message = ask(peer, "startup", "/diamond")
        assert not success
        assert message.startswith("/middle: it did not activate: ValueError: no map")
        rolling = system.told(RollingBack)[0]
        assert (rolling.node, rolling.reason) == (
            "/middle", "it did not activate: ValueError: no map",
        )  # fmt: skip
        changes = system.told(StateChanged)
        up = [event.node for event in changes if event.state == "active"]
        assert set(up) == {"/low", "/right", "/left_0", "/left"}
        down = [
            event.node
            for event in changes
            if event.elapsed_s > rolling.elapsed_s and event.transition == "deactivate"
        ]
        assert down == list(reversed(up))
        assert set(system.told(RolledBack)[0].nodes) == {
            f"/{name}" for name in
            ("top", "left_3", "left_2", "right_3", "right_2", "left", "right", "left_0", "low")
        }  # fmt: skip
        for name in ("low", "middle", "top"):
            assert peer.state(f"/{name}") == "unconfigured"

        assert peer.set_parameter("/middle", "fault", "") == ""
        assert ask(peer, "startup", "/diamond") == (True, "10 of 10 nodes active")
        assert system.stop().exit_code == 0


def test_a_second_composer_of_the_same_system_is_refused(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER) as first:
        system = system_of(ROBOT, tmp_path)
        second = Host(system, first.host._up, first.host._down, HostOptions())
        with pytest.raises(StartRefused, match="system '/fleet/robot' runs already") as why:
            second.run()
        assert "process" in str(why.value)
        assert "compose down /fleet/robot" in why.value.hint
        assert peer.state("/fleet/planner") == "active"
    again = RunningSystem(system_of(ROBOT, tmp_path), HostOptions(run_for_s=0.1), None)
    assert again.end().exit_code == 0
