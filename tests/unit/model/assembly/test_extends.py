"""Node types that are varieties of others."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.loading import load, load_files
from composer.loading.reported import collect_diagnostics
from tests.unit.support.checking import places, valid_system, write_files

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
FILES = {
    "s.yaml": "system: s\nnodes: {front: {type: camera, publishers: {output: {external: true}}}}\n",
    "nodes/camera.yaml": CAMERA,
    "nodes/sensor.yaml": SENSOR,
    "nodes/sensor.py": BEHAVIOR,
}


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_files(tmp_path, FILES)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def found(*names: str) -> list[str]:
    return places(collect_diagnostics(load_files([Path(name) for name in names])))


def test_a_node_has_what_both_types_say(project: Path) -> None:
    [camera] = valid_system(Path(), FILES).nodes
    assert camera.description == "A camera."
    [output] = camera.ports
    assert output.interface.value == "std_msgs/msg/String"
    assert output.interface.span.file.path == "nodes/camera.yaml"
    rate = camera.parameter("rate_hz")
    assert (rate.value.value, str(rate.type), rate.unit) == (30.0, "double", "m")
    assert camera.timers[0].period.unit.value == "period_ms"
    assert camera.behavior.folder == project / "nodes"
    assert [path.name for path in camera.type_files] == ["camera.yaml", "sensor.yaml"]
    alone = load(Path("nodes/camera.yaml"))
    assert [port.name.value for port in alone.system.nodes[0].ports] == ["output"]
    # A type that is only extended is used.
    assert found("s.yaml", "nodes/camera.yaml", "nodes/sensor.yaml") == []


@pytest.mark.parametrize(
    ("changed", "loaded", "reported"),
    [
        pytest.param(
            {
                "nodes/sensor.yaml": SENSOR.replace('rate_hz: "{par', 'rate_hz: "{prm'),
                "nodes/camera.yaml": CAMERA.replace("period_ms: 20", "periodms: 20"),
            },
            ["nodes/camera.yaml", "s.yaml"],
            ["nodes/camera.yaml:6:17 unknown-key", "nodes/sensor.yaml:10:21 unknown-name"],
            id="mistakes, where they are written",
        ),
        pytest.param(
            {"nodes/sensor.yaml": "node: sensor\nextends: camera\n"},
            ["s.yaml", "nodes/sensor.yaml", "nodes/camera.yaml"],
            ["nodes/camera.yaml:2:10 cycle"],
            id="a cycle, once",
        ),
    ],
)
def test_mistakes(
    project: Path, changed: dict[str, str], loaded: list[str], reported: list[str]
) -> None:
    write_files(project, changed)
    assert found(*loaded) == reported


def test_the_other_type_is_missing(project: Path) -> None:
    write_files(project, {"nodes/camera.yaml": CAMERA.replace("sensor", "sensr")})
    [diagnostic] = load(Path("s.yaml")).diagnostics
    assert str(diagnostic.primary) == "nodes/camera.yaml:2:10"
    assert diagnostic.hint == "did you mean 'sensor'?"


def test_a_long_line_of_types(project: Path) -> None:
    types = {f"nodes/t{n}.yaml": f"node: t{n}\nextends: t{n + 1}\n" for n in range(20)}
    write_files(project, types | {"nodes/t20.yaml": "node: t20\n"})
    assert found("nodes/t0.yaml") == ["nodes/t16.yaml:2:10 too-large"]
    assert found("nodes/t10.yaml") == []
