"""The processes of a system, and the part of the model that each of them runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.model import OnFailure, PrimaryState, System, member_system
from tests.unit.support.checking import valid_system

TEXT = """
system: robot
namespace: lab
lifecycle: {on_failure: shutdown}
hosts: {jetson: {address: 10.0.0.5, user: pilot, workspace: ~/robot, setup: [env.sh]}}
processes:
  vision: {nodes: ["camera_*"], cpus: [1, 2], environment: {SIZE: 3}, memory_mb: 200, host: jetson}
  control: {}
nodes:
  camera_front: {on_activate: {log: on}}
  camera_rear: {on_activate: {log: on}, lifecycle: {depends_on: [arm], on_failure: restart}}
  arm: {process: control, on_activate: {log: on}}
  logger: {on_activate: {log: on}}
"""


@pytest.fixture
def system(tmp_path: Path) -> System:
    return valid_system(tmp_path, {"robot.yaml": TEXT})


def test_nodes_have_processes_by_name_pattern_and_key(system: System) -> None:
    processes = {node.name.value: node.process and node.process.value for node in system.nodes}
    assert processes == {
        "camera_front": "vision",
        "camera_rear": "vision",
        "arm": "control",
        "logger": None,
    }
    vision = system.processes[0]
    assert (vision.cpus, vision.memory_mb.value, vision.host.value) == ((1, 2), 200, "jetson")
    assert [(name.value, value) for name, value in vision.environment] == [("SIZE", "3")]
    assert system.hosts[0].login == "pilot@10.0.0.5"
    assert system.hosts[0].setup == ("env.sh",)


def test_a_process_only_takes_failed_nodes_down_and_knows_how_far_nodes_start(
    system: System,
) -> None:
    member = member_system(system, "vision", {"camera_front": PrimaryState.INACTIVE})
    assert member.name.value == "robot/vision"
    assert [node.full_name for node in member.nodes] == ["/lab/camera_front", "/lab/camera_rear"]
    for node in member.nodes:
        assert node.in_process
        assert not node.depends_on
        assert node.supervision.policy is OnFailure.ISOLATE
    front, rear = member.nodes
    assert front.autostart.value is PrimaryState.INACTIVE
    assert rear.autostart is None
