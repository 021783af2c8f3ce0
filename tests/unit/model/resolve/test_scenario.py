"""Scenarios with their systems: arguments, overrides and stand-ins, names, times."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load
from composer.loading.reported import LoadResult
from composer.model.scenario import EventKind, ExpectationKind, Verb
from tests.unit.support.checking import write_files

SYSTEM = """\
system: robot
namespace: /bot
arguments: {rate_hz: {type: double, default: 5.0}}
lifecycle: {on_failure: restart}
processes: {sensing: {nodes: [lidar]}}
nodes:
  lidar:
    executable: {package: lidar_driver, name: driver}
    parameters: {device: {type: string, default: /dev/lidar}}
    publishers: {points: {type: std_msgs/msg/String, qos: sensor_data}}
  viewer:
    subscriptions: {points: {type: std_msgs/msg/String, qos: sensor_data, log: seen}}
    timers: {tick: {rate_hz: "${rate_hz}", log: tick}}
connections:
  - {topic: scan, from: lidar.points, to: viewer.points}
"""
FAKE = """\
node: fake_lidar
parameters: {text: {type: string, default: none}}
publishers: {points: {type: std_msgs/msg/String, qos: sensor_data}}
timers: {tick: {rate_hz: 10, publish: {points: {data: "{parameters.text}"}}}}
"""

STAND_IN = "overrides: {nodes: {lidar: {type: fake_lidar, parameters: {text: wall}}}}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    files = {"composer.yaml": "", "systems/robot.yaml": SYSTEM, "nodes/fake_lidar.yaml": FAKE}
    write_files(tmp_path, files)
    (tmp_path / "scenarios").mkdir()
    return tmp_path


def scenario(folder: Path, text: str, system: str = "robot") -> LoadResult:
    path = folder / "scenarios" / "test.yaml"
    path.write_text(f"scenario: test\nsystem: {system}\nfor_s: 5\n{text}")
    return load(path, shown="test.yaml")


def reported(result: LoadResult) -> list[str]:
    return [f"{item.primary.line}: {item.message}" for item in result.diagnostics]


@pytest.mark.parametrize("system", ["robot", "../systems/robot.yaml"])
def test_a_stand_in_replaces_an_implementation_and_keeps_wiring(folder: Path, system: str) -> None:
    result = scenario(folder, f"{STAND_IN}arguments: {{rate_hz: 20}}\n", system)
    assert reported(result) == []
    lidar, viewer = result.system.node("lidar"), result.system.node("viewer")
    assert (lidar.executable, lidar.full_name) == (None, "/bot/lidar")
    assert lidar.ports[0].full_name == "/bot/scan"
    assert lidar.initial_parameters == {"text": "wall"}
    assert viewer.period_s(viewer.timers[0]) == 0.05
    assert result.system.supervision.on_failure is not None


def test_steps_and_expectations(folder: Path) -> None:
    result = scenario(
        folder,
        f"{STAND_IN}seed: 3\n"
        "steps:\n"
        "  - {after_s: 1, publish: {scan: {data: x}}, drop: {/bot/scan: {count: 2, for_s: 1.5}}}\n"
        "  - when: {message: scan, where: message.data == 'x'}\n"
        "    expect: [{silence: scan, after_s: 1, for_s: 2}]\n"
        "expect: [{order: [{state: {lidar: active}}, {log: seen, level: info}], within_s: 3}]\n",
    )
    assert reported(result) == []
    found = result.scenario
    assert (found.seed, found.for_s.value, len(found.conditions)) == (3, 5, 4)
    first, second = found.steps
    assert [(item.verb, item.name.value) for item in first.actions] == [
        (Verb.PUBLISH, "/bot/scan"),
        (Verb.DROP, "/bot/scan"),
    ]
    assert first.actions[1].options["for_s"].value == 1.5
    assert (second.when.kind, second.when.name.value) == (EventKind.MESSAGE, "/bot/scan")
    [silence] = second.expectations
    assert (silence.kind, silence.until_s.value) == (ExpectationKind.SILENCE, 3)


def test_errors_of_the_system_are_reported_with_its_file(folder: Path) -> None:
    (folder / "systems" / "robot.yaml").write_text(SYSTEM.replace("viewer.points", "viewer.point"))
    result = scenario(folder, "")
    [error] = [item for item in result.diagnostics if item.rule.name == "unknown-port"]
    assert error.primary.file.path.endswith("robot.yaml")
    assert result.scenario is not None
    assert not result.is_runnable
