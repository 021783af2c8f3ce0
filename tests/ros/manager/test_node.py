"""The manager node: commands for the whole system, its status, and other instances."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import String
from std_srvs.srv import Trigger

from composer.model import PrimaryState
from composer.plan import bring_up, tear_down
from composer.runtime.clock import COMPUTER
from composer.runtime.host import Host
from composer.runtime.host_options import HostOptions
from composer.runtime.manager import other_instances
from composer.runtime.manager.other_instances import is_older, parse_instance
from composer.runtime.manager.publishing import diagnostic_array
from composer.runtime.process import StartRefused
from composer.runtime.protocol.codec import decode, encode
from composer.runtime.protocol.reports import CallbackFigures, NodeReport, SystemReport
from composer.runtime.protocol.requests import Instance
from composer.runtime.ros.service_requests import STATE_QOS
from composer.runtime.supervision.events import StateChanged, Stopping
from composer.runtime.supervision.status import Status
from tests.ros.support.commands import hand_written
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


def command(peer: Peer, name: str, system: str = "/fleet/robot") -> tuple[bool, str]:
    response = peer.call(Trigger, f"{system}/manager/{name}")
    return response.success, response.message


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {item.key: item.value for item in status.values}


def seconds(message: DiagnosticArray) -> float:
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec * 1e-9)


def are_a_second_apart(messages: list[DiagnosticArray]) -> bool:
    """Return whether they were sent once a second."""
    times_s = [seconds(message) for message in messages]
    return all(0.8 < later_s - s < 1.2 for s, later_s in itertools.pairwise(times_s))


def latest(messages: list[Any]) -> dict[str, dict[str, str]]:
    """Return the values of the last message, by the names of its statuses."""
    return {status.name: values(status) for status in messages[-1].status}


def reported(messages: list[String]) -> dict[str, NodeReport]:
    """Return the nodes in the last report, by name."""
    return {node.node: node for node in decode(messages[-1].data, SystemReport).nodes}


def test_commands_pause_resume_reset_and_start_a_system(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER) as system:
        assert command(peer, "is_active") == (True, "2 of 3 nodes active")
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
            before = len(system.reported(StateChanged))
            assert command(peer, what) == (True, message)
            changes = [str(event) for event in system.reported(StateChanged)[before:]]
            assert sorted(changes) == sorted(states), what
            assert command(peer, "is_active")[0] is (message.startswith("2")), what
        # Finalized nodes are created again.
        assert peer.change("/fleet/planner", "shutdown")
        assert not peer.change("/fleet/planner", "configure")
        assert command(peer, "is_active") == (False, "1 of 3 nodes active")
        finalized = peer.servers("/fleet/planner/get_state")
        assert command(peer, "startup") == (True, "2 of 3 nodes active")
        wait_until(lambda: peer.servers("/fleet/planner/get_state") - finalized, "the new node")
        assert peer.state("/fleet/planner") == "active"
        assert command(peer, "shutdown")[0]
        assert system.end().exit_code == 0
    assert system.end().reason == "shutdown requested"
    assert system.states()[-3:][0] in ("/fleet/camera finalized", "/fleet/motor finalized")


def test_a_system_is_not_active_after_the_failure_of_an_inactive_node(
    tmp_path: Path, peer: Peer
) -> None:
    camera = "camera: {behavior: planner:Planner, parameters: {fault: activate}, "
    with running(ROBOT.replace("camera: {", camera), tmp_path, planner=PLANNER):
        assert command(peer, "is_active") == (True, "2 of 3 nodes active")
        assert not peer.change("/fleet/camera", "activate")
        wait_until(
            lambda: "/fleet/camera is isolated" in command(peer, "is_active")[1], "the failure"
        )
        success, message = command(peer, "is_active")
        assert not success
        assert message.startswith("2 of 3 nodes active, /fleet/camera is isolated: activate ended")
        assert command(peer, "startup") == (True, "2 of 3 nodes active")
        assert command(peer, "is_active")[0]


FAULTS = (
    ("configure", "/fleet/planner: configure failed: ValueError: no map"),
    ("refuse activate", "/fleet/planner: activate failed: not now"),
)


def test_a_failed_start_is_rolled_back_and_can_be_retried(tmp_path: Path, peer: Peer) -> None:
    with running(ROBOT, tmp_path, autostart=PrimaryState.UNCONFIGURED, planner=PLANNER) as system:
        for fault, words in FAULTS:
            assert peer.set_parameter("/fleet/planner", "fault", fault) == ""
            success, message = command(peer, "startup_all_or_nothing")
            assert not success
            assert message.startswith(words)
            assert message.endswith("0 of 3 nodes active")
            for node in ("planner", "motor", "camera"):
                assert peer.state(f"/fleet/{node}") == "unconfigured"
        assert peer.set_parameter("/fleet/planner", "fault", "") == ""
        assert command(peer, "startup") == (True, "2 of 3 nodes active")
        # A failed pause is reported as well.
        assert peer.set_parameter("/fleet/planner", "fault", "refuse deactivate") == ""
        success, message = command(peer, "pause")
        assert not success
        assert "/fleet/planner: deactivate failed: not now" in message
        assert peer.set_parameter("/fleet/planner", "fault", "") == ""
        assert command(peer, "startup") == (True, "2 of 3 nodes active")
        assert system.stop().exit_code == 0


def test_states_are_published_latched_on_change_and_every_second(
    tmp_path: Path, peer: Peer
) -> None:
    with running(ROBOT, tmp_path, planner=PLANNER):
        states = peer.listen(String, "/fleet/robot/manager/state", STATE_QOS)
        wait_until(lambda: states, "the latched state")
        diagnostics = peer.listen(DiagnosticArray, "/diagnostics")
        wait_until(lambda: len(diagnostics) >= 5, "messages at once, then every second")
        wait_until(lambda: are_a_second_apart(diagnostics[-3:]), "a message every second")
        status = latest(diagnostics)
        assert list(status) == [
            "robot", "robot: /fleet/planner", "robot: /fleet/motor", "robot: /fleet/camera",
        ]  # fmt: skip
        assert status["robot: /fleet/planner"]["state"] == "active"
        assert status["robot: /fleet/camera"]["state"] == "inactive"
        assert status["robot"]["activity"] == "running"
        assert diagnostics[-1].status[0].level == DiagnosticStatus.OK

        assert peer.set_parameter("/fleet/planner", "fault", "deactivate") == ""
        assert not peer.change("/fleet/planner", "deactivate")
        wait_until(lambda: reported(states)["/fleet/motor"].state == "inactive", "the new state")
        # It is reported as held down after its dependents were deactivated.
        wait_until(lambda: reported(states)["/fleet/planner"].held_down, "the node to be held down")
        planner = reported(states)["/fleet/planner"]
        assert planner.state == "unconfigured"
        assert planner.held_down == "deactivate ended in an error: ValueError: no map"
        assert planner.last_error == "deactivate ended in an error: ValueError: no map"
        wait_until(
            lambda: diagnostics[-1].status[0].level == DiagnosticStatus.ERROR, "the diagnostics"
        )
        assert "/fleet/planner is isolated" in diagnostics[-1].status[0].message


def test_a_second_instance_is_refused_and_no_status_is_lost(tmp_path: Path, peer: Peer) -> None:
    def lost() -> int:
        """Count the messages that ``ros2 topic echo`` reports as replaced before it got them."""
        with hand_written("roles.py", "echo", "/fleet/robot/manager/state") as process:
            assert process.stdout is not None
            return int(process.stdout.readline())

    with running(ROBOT, tmp_path, planner=PLANNER):
        system = system_of(ROBOT, tmp_path)
        second = Host(system, bring_up(system), tear_down(system), HostOptions())
        with pytest.raises(StartRefused, match="system '/fleet/robot' already runs") as refusal:
            second.run()
        assert "process" in str(refusal.value)
        assert "compose down /fleet/robot" in refusal.value.hint
        assert peer.state("/fleet/planner") == "active"
        # A process may not be scheduled for longer than the manager waits.
        wait_until(lambda: lost() == 0, "a subscription that loses no status")
    options = HostOptions(run_for_s=0.1, stop_within_s=20.0)
    again = RunningSystem(system_of(ROBOT, tmp_path), options, None)
    assert again.end().exit_code == 0


def test_the_length_of_reported_texts_is_limited(tmp_path: Path) -> None:
    status = Status(system_of(ROBOT, tmp_path), COMPUTER)
    status.set_error("planner", 10_000 * "x")
    status.set_desired({}, {"planner": 10_000 * "y"}, {})
    report = status.snapshot()
    assert all(len(node.last_error + node.held_down) < 1100 for node in report.nodes)
    assert len(report.message) < 700


def test_diagnostics_can_be_sent_whatever_user_code_reports() -> None:
    node = NodeReport("/arm", "active", last_error="\ud800 é", sent={"/a": 3}, sent_hz=0.5)
    callback = CallbackFigures("/arm", "timer", "tick", overruns=2)
    report = SystemReport("robot", "running", (node,), "vm", "1", at_s=1.5)
    content = serialize_message(diagnostic_array(report, 2.0, (), (callback,)))
    message = deserialize_message(content, DiagnosticArray)
    assert seconds(message) == 1.5
    system, arm, tick = message.status
    assert values(system)["ready"] == "false"
    assert values(arm)["last_error"] == "? é"
    assert [values(arm)[key] for key in ("sent", "sent_hz", "busy")] == ["/a=3", "0.5", ""]
    assert (tick.level, tick.message) == (DiagnosticStatus.WARN, "2 over budget, 0 dropped")


PLANNING = "{system: robot, namespace: fleet, nodes: {planner: {}}}"
STATE_TOPIC = "/fleet/robot/manager/state"


def offer_managers(peer: Peer, *messages: str) -> list[str]:
    """Offer the services of other manager nodes; return the list of those that are asked."""
    requests: list[str] = []

    def offer(name: str, message: str) -> None:
        def respond(_: Any, response: Trigger.Response) -> Trigger.Response:
            requests.append(name)
            response.message = message
            return response

        peer.node.create_service(Trigger, f"/fleet/robot/manager/{name}", respond)

    offer("is_active", messages[0])
    for number, message in enumerate(messages):
        offer(f"_instance_{number:04}", message)
    return requests


def instance(uptime_s: float) -> str:
    return encode(Instance("elsewhere", "4321", uptime_s))


def test_no_message_ends_a_system(tmp_path: Path, peer: Peer) -> None:
    with running(PLANNING, tmp_path) as system:
        received = peer.listen(String, STATE_TOPIC, STATE_QOS)
        wait_until(lambda: received, "a message to replay")
        publisher = peer.publisher(String, STATE_TOPIC, STATE_QOS)
        report = decode(received[0].data, SystemReport)
        replayed = encode(replace(report, host="elsewhere", pid="4321", started_s=1.0))
        forged = itertools.cycle((replayed, replayed.replace("running", "stopped"), ""))

        def flood() -> bool:
            """Publish once more; return whether the manager has published twice meanwhile."""
            publisher.publish(String(data=next(forged)))
            return sum("content" in item.data and "4321" not in item.data for item in received) > 2

        wait_until(flood, "messages of the manager")
        assert not system.reported(Stopping)
        assert "exception" not in system.log_text().lower()
        assert peer.call(Trigger, "/fleet/robot/manager/is_active").success


def test_a_system_is_refused_while_it_starts(tmp_path: Path, peer: Peer) -> None:
    offer_managers(peer, instance(uptime_s=3600.0))
    system = RunningSystem(system_of(PLANNING, tmp_path), HostOptions(), None)
    outcome = system.end()
    assert outcome.exit_code == 1
    assert "system '/fleet/robot' already runs in ROS domain" in outcome.reason
    assert "host elsewhere, process 4321" in outcome.reason


def test_younger_and_unreadable_instances_are_ignored(tmp_path: Path, peer: Peer) -> None:
    odd_host = encode(Instance("a\x1b[2J", "1", 9e9))
    requests = offer_managers(peer, instance(uptime_s=0.0), odd_host, "[" * 100_000)
    with running(PLANNING, tmp_path) as system:
        wait_until(lambda: len(set(requests)) == 3, "requests to the other managers")
        assert peer.call(Trigger, "/fleet/robot/manager/is_active") is not None
        assert not system.reported(Stopping)
        assert "4321" not in system.log_text()


def test_a_system_that_has_started_warns_once(
    tmp_path: Path, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(other_instances, "START_S", 0.0)
    with running(PLANNING, tmp_path) as system:
        requests = offer_managers(peer, instance(uptime_s=3600.0))
        line = system.wait_for_log("host elsewhere, process 4321")
        assert "stop one of them" in line
        received = peer.listen(String, STATE_TOPIC, STATE_QOS)
        wait_until(lambda: len(received) >= 3, "the next checks, once a second")
        assert system.log().count(line) == 1
        assert requests == ["_instance_0000"]
        assert not system.reported(Stopping)


def test_the_older_instance_is_decided_by_uptime_then_by_name() -> None:
    first, second = Instance("a", "1", 60.0), Instance("a", "2", 30.0)
    assert is_older(first, second)
    assert not is_older(second, first)
    together = Instance("a", "2", 60.05)
    assert is_older(first, together)
    assert not is_older(together, first)
    assert parse_instance(encode(first)) == first
    for text in ("", "[]", encode(Instance("a b", "1", 1.0))):
        assert parse_instance(text) is None
