"""Node types that are varieties of others."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Diagnostic
from composer.loading import load, load_files
from composer.loading.reported import collect_diagnostics
from composer.model import Node

SENSOR = """\
node: sensor
description: Any sensor.
behavior: sensor:Sensor
variables: {message_type: {description: What it measures.}, unit: {default: m}}
parameters:
  rate_hz: {type: double, default: 10.0, maximum: 100.0, unit: "${unit}"}
publishers:
  output: {type: "${message_type}", qos: sensor_data}
timers:
  tick: {rate_hz: "{parameters.rate_hz}"}
"""
CAMERA = """\
node: camera
extends: sensor
description: A camera.
variables: {message_type: {default: std_msgs/msg/String}}
parameters: {rate_hz: 30.0}
timers: {tick: {period_ms: 20}}
"""
BEHAVIOR = """\
from composer.behavior import Behavior
class Sensor(Behavior):
    def on_tick(self):
        self.publishers.output.publish(self.publishers.output.message_type())
"""
SYSTEM = """\
system: s
nodes:
  front:
    type: camera
    publishers: {output: {external: true}}
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "nodes").mkdir()
    write(tmp_path, "nodes/sensor.yaml", SENSOR)
    write(tmp_path, "nodes/sensor.py", BEHAVIOR)
    write(tmp_path, "nodes/camera.yaml", CAMERA)
    write(tmp_path, "s.yaml", SYSTEM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(folder: Path, name: str, text: str) -> None:
    (folder / name).write_text(text, encoding="utf-8")


def node_in(name: str) -> Node:
    loading = load(Path(name))
    assert [item.message for item in loading.diagnostics] == []
    assert loading.system is not None
    return loading.system.nodes[0]


def test_what_the_other_type_has(project: Path) -> None:
    camera = node_in("s.yaml")
    assert camera.description == "A camera."
    [output] = camera.ports
    assert (output.interface.value, output.interface.span.file.path) == (
        "std_msgs/msg/String",
        "nodes/camera.yaml",
    )
    rate = camera.parameter("rate_hz")
    assert rate is not None
    assert rate.value is not None
    assert (rate.value.value, str(rate.type), rate.unit) == (30.0, "double", "m")
    assert camera.timers[0].period.unit.value == "period_ms"
    assert camera.behavior is not None
    assert camera.behavior.folder == project / "nodes"
    assert [path.name for path in camera.type_files] == ["camera.yaml", "sensor.yaml"]


def test_a_type_alone(project: Path) -> None:
    assert [port.name.value for port in node_in("nodes/camera.yaml").ports] == ["output"]


def found(*names: str) -> list[str]:
    diagnostics: list[Diagnostic] = collect_diagnostics(load_files([Path(name) for name in names]))
    return [f"{item.primary} {item.rule.name}" for item in diagnostics]


def test_a_type_that_is_extended_only_is_used(project: Path) -> None:
    assert found("s.yaml", "nodes/camera.yaml", "nodes/sensor.yaml") == []


def test_a_mistake_is_reported_where_it_is_written(project: Path) -> None:
    write(project, "nodes/sensor.yaml", SENSOR.replace('rate_hz: "{par', 'rate_hz: "{prm'))
    write(project, "nodes/camera.yaml", CAMERA.replace("period_ms: 20", "periodms: 20"))
    assert found("nodes/camera.yaml", "s.yaml") == [
        "nodes/camera.yaml:6:17 unknown-key",
        "nodes/sensor.yaml:10:21 unknown-name",
    ]


def test_a_cycle_is_one_diagnostic(project: Path) -> None:
    write(project, "nodes/sensor.yaml", "node: sensor\nextends: camera\n")
    assert found("s.yaml", "nodes/sensor.yaml", "nodes/camera.yaml") == [
        "nodes/camera.yaml:2:10 cycle"
    ]


def test_the_other_type_is_missing(project: Path) -> None:
    write(project, "nodes/camera.yaml", CAMERA.replace("sensor", "sensr"))
    diagnostics = load(Path("s.yaml")).diagnostics
    assert [(str(item.primary), item.hint) for item in diagnostics] == [
        ("nodes/camera.yaml:2:10", "did you mean 'sensor'?")
    ]


def test_a_long_line_of_types(project: Path) -> None:
    for number in range(20):
        write(project, f"nodes/t{number}.yaml", f"node: t{number}\nextends: t{number + 1}\n")
    write(project, "nodes/t20.yaml", "node: t20\n")
    assert found("nodes/t0.yaml") == ["nodes/t16.yaml:2:10 too-large"]
    assert found("nodes/t10.yaml") == []
