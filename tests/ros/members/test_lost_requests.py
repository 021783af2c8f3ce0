"""Requests to a process of a system that are lost, arrive twice, or arrive too late."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import TransitionEvent
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from std_srvs.srv import Trigger

from composer.runtime.ros.manager_protocol import STATE_QOS
from composer.runtime.supervision.events import NodeFailed
from tests.ros.members.split_robot import command_of, split
from tests.ros.support.in_process import Peer, finished, wait_until

#: What a service keeps of requests that it has not taken yet.
QUEUE = 10
TEXT = """
system: robot
namespace: lab
processes: {other: {nodes: [camera]}}
nodes:
  camera:
    behavior: busy:Busy
    parameters: {folder: ""}
    timers: {tick: {period_ms: 20}}
"""
#: Nothing of Python runs in a process while C holds the interpreter's lock; DDS does.
BUSY = """
import ctypes
from pathlib import Path
from composer.behavior import Behavior

class Busy(Behavior):
    def on_tick(self):
        folder = self.parameters.folder
        if folder and not Path(folder, "busy").exists():
            Path(folder, "busy").touch()
            ctypes.PyDLL(None).usleep(1_500_000)
"""
SERVICE = "/lab/robot/other/manager/change_states"
STATE = "/lab/robot/other/manager/state"


def test_a_request_that_a_full_queue_has_dropped_is_sent_again(tmp_path: Path, peer: Peer) -> None:
    tmp_path.joinpath("busy.py").write_text(BUSY, encoding="utf-8")
    with split(tmp_path, TEXT) as system:
        moves = peer.listen(TransitionEvent, "/lab/camera/transition_event")
        peer.wait_until_known("/lab/camera")
        flood = peer.client(SetParameters, SERVICE)
        requests = system.host._node_set.other_processes._processes["other"].requests
        assert peer.set_parameter("/lab/camera", "folder", str(tmp_path)) == ""
        wait_until(tmp_path.joinpath("busy").exists, "the process")
        pause = peer.begin(Trigger, "/lab/robot/manager/pause")
        wait_until(lambda: any(sent.steps for sent in requests._sent.values()), "the request")
        for _ in range(QUEUE + 2):
            flood.call_async(request_of([], participant="that of another process"))
        assert finished(pause).success
        problem = "process 'other' has not received 'deactivate /lab/camera'; it is requested again"
        assert system.log().count(problem) == 1
        assert labels(moves) == ["deactivating", "inactive"]
        assert not system.reported(NodeFailed)


@pytest.fixture
def member(tmp_path: Path, peer: Peer) -> Iterator[list[DiagnosticArray]]:
    """The reports of a process that runs on its own."""
    path = tmp_path / "robot.yaml"
    path.write_text(TEXT, encoding="utf-8")
    tmp_path.joinpath("busy.py").write_text(BUSY, encoding="utf-8")
    process = subprocess.Popen([*command_of(path), "--process", "other"], stderr=subprocess.DEVNULL)
    try:
        reports = peer.listen(DiagnosticArray, STATE, STATE_QOS)
        wait_until(lambda: reports and value(reports, "activity") == "running", "its nodes")
        yield reports
    finally:
        process.terminate()
        assert process.wait(60.0) == 0


def test_a_step_that_arrives_twice_is_run_once(member: list[DiagnosticArray], peer: Peer) -> None:
    moves = peer.listen(TransitionEvent, "/lab/camera/transition_event")
    configure = numbered({1: "configure /lab/camera"})
    calls = [peer.begin(SetParameters, SERVICE, configure) for _ in range(2)]
    first, second = (finished(call).results for call in calls)
    assert first[0].successful
    assert first == second
    (unknown,) = peer.call(SetParameters, SERVICE, numbered({2: "configure /lab/arm"})).results
    assert unknown.reason == "the process has no such node"
    both = numbered({3: "activate /lab/camera", 1: "configure /lab/camera"})
    activated, outdated = peer.call(SetParameters, SERVICE, both).results
    assert activated.successful
    assert outdated.reason == "a later request was received before"
    wait_until(lambda: len(moves) >= 4, "the transitions")
    assert labels(moves) == ["configuring", "inactive", "activating", "active"]
    wait_until(lambda: value(member, "last_step") == "peer 3", "the report")


def test_a_step_that_arrives_too_late_is_not_run(member: list[DiagnosticArray], peer: Peer) -> None:
    """Its sender does not wait for it any more: it has seen no report for longer than that."""
    moves = peer.listen(TransitionEvent, "/lab/camera/transition_event")
    seen = int(value(member, "number"))
    for number, transition in enumerate(("configure", "activate"), 1):
        steps = {number: f"{transition} /lab/camera"}
        (result,) = peer.call(SetParameters, SERVICE, numbered(steps, seen)).results
        assert result.successful, result.reason
    wait_until(lambda: int(value(member, "number")) > seen + 10, "reports of ten seconds")
    for steps in ({3: "shutdown /lab/camera"}, {4: "deactivate /lab/camera"}):
        peer.client(SetParameters, SERVICE).call_async(numbered(steps, seen))
    fresh = numbered({5: "cleanup /lab/camera"}, int(value(member, "number")))
    (result,) = peer.call(SetParameters, SERVICE, fresh).results
    assert "the node is active" in result.reason  # requests arrive in order
    assert labels(moves) == ["configuring", "inactive", "activating", "active"]


def value(reports: list[DiagnosticArray], key: str) -> str:
    return next(item.value for item in reports[-1].status[0].values if item.key == key)


def labels(moves: list[TransitionEvent]) -> list[str]:
    return [move.goal_state.label for move in moves]


def numbered(steps: dict[int, str], seen: int | None = None) -> SetParameters.Request:
    return request_of(list(steps.values()), numbers=list(steps), sender="peer", seen_report=seen)


def request_of(steps: list[str], **others: Any) -> SetParameters.Request:
    kinds = {str: "string", int: "integer", list: "integer_array"}
    kind = ParameterType.PARAMETER_STRING_ARRAY
    array = ParameterValue(type=kind, string_array_value=steps)
    parameters = [Parameter(name="steps", value=array)]
    for name, content in others.items():
        if content is not None:
            filled = ParameterValue(**{f"{kinds[type(content)]}_value": content})
            parameters.append(Parameter(name=name, value=filled))
    return SetParameters.Request(parameters=parameters)
