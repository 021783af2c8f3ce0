"""The processes of a system, and the part of the model that each of them runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.model import OnFailure, PrimaryState, System, member_system

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
    path = tmp_path / "robot.yaml"
    path.write_text(TEXT, encoding="utf-8")
    result = load(path)
    assert result.system is not None
    assert not result.diagnostics
    return result.system


def test_nodes_have_processes_by_name_pattern_and_key(system: System) -> None:
    processes = {
        node.name.value: None if node.process is None else node.process.value
        for node in system.nodes
    }
    assert processes == {
        "camera_front": "vision",
        "camera_rear": "vision",
        "arm": "control",
        "logger": None,
    }
    vision = system.processes[0]
    assert vision.cpus == (1, 2)
    assert [(name.value, value) for name, value in vision.environment] == [("SIZE", "3")]
    assert vision.memory_mb is not None
    assert vision.memory_mb.value == 200
    assert vision.host is not None
    assert vision.host.value == "jetson"
    assert system.hosts[0].login == "pilot@10.0.0.5"
    assert system.hosts[0].setup == ("env.sh",)


def test_a_process_only_takes_failed_nodes_down(system: System) -> None:
    member = member_system(system, "vision")
    assert member.name.value == "robot/vision"
    assert [node.full_name for node in member.nodes] == ["/lab/camera_front", "/lab/camera_rear"]
    for node in member.nodes:
        assert node.in_process
        assert not node.depends_on
        assert node.supervision.policy is OnFailure.ISOLATE


def test_a_process_knows_how_far_its_nodes_start(system: System) -> None:
    member = member_system(system, "vision", {"camera_front": PrimaryState.INACTIVE})
    front, rear = member.nodes
    assert front.autostart is not None
    assert front.autostart.value is PrimaryState.INACTIVE
    assert rear.autostart is None
