from __future__ import annotations

from pathlib import Path

import pytest

from composer.base.diagnostics import Severity
from composer.base.folders import nodes_folder, systems_folder
from composer.interfaces import Interfaces
from composer.loading import load
from composer.loading.reported import LoadResult
from composer.model.resolve import OverrideOptions
from composer.project.files import find_files

GOOD = """\
system: robot
nodes:
  talker:
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
    timers: {tick: {period_ms: 100, publish: {chatter: {data: hello}}}}
    parameters: {speed: {type: double, default: 1.0, maximum: 2.0}}
  listener:
    subscriptions: {chatter: {type: std_msgs/msg/String, qos: command, log: "{message.data}"}}
"""


@pytest.fixture(scope="module")
def interfaces() -> Interfaces:
    return Interfaces.load()


def errors(loading: LoadResult) -> list[str]:
    return [
        f"{diagnostic.primary.file.path}:{diagnostic.primary.line} {diagnostic.rule.name}"
        for diagnostic in loading.diagnostics
        if diagnostic.severity is Severity.ERROR
    ]


def write(folder: Path, text: str, name: str = "robot.yaml") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "path", find_files([systems_folder(), nodes_folder()]).files, ids=lambda path: path.stem
)
def test_everything_that_comes_with_the_composer_is_without_errors(path: Path) -> None:
    loading = load(path)
    assert errors(loading) == []
    assert loading.is_runnable == (path.parent == systems_folder())


def test_one_run_shows_what_every_stage_finds(tmp_path: Path, interfaces: Interfaces) -> None:
    camera = "node: camera\nservices: {ask: {typ: std_srvs/srv/Trigger}}\n"
    write(tmp_path, camera, "nodes/camera.yaml")
    path = write(
        tmp_path,
        """\
system: robot
system: again
arguments: {unit: [1]}
nodes:
  front: {type: camera}
  talker:
    description: in ${unit}
    executor: nowhere
    colour: red
    timers: {tick: {period_ms: 100, log: "{1 +}"}}
""",
    )
    loading = load(path, shown="robot.yaml", interfaces=interfaces)
    found = errors(loading)
    for line, rule in (
        ("robot.yaml:2", "duplicate-key"),
        ("robot.yaml:7", "malformed-variable"),
        ("robot.yaml:8", "undeclared-name"),
        ("robot.yaml:9", "unknown-key"),
        ("robot.yaml:10", "invalid-expression"),
    ):
        assert f"{line} {rule}" in found
    assert any(item.startswith(str(tmp_path / "nodes" / "camera.yaml") + ":2 ") for item in found)
    assert not loading.is_runnable
    places = [diagnostic.sort_key for diagnostic in loading.diagnostics]
    assert places == sorted(places)


def test_the_command_line_is_checked_like_the_file(tmp_path: Path, interfaces: Interfaces) -> None:
    path = write(tmp_path, GOOD)
    settings = ("talker.speed=9.0", "talker.sped=1.0", "missing.speed=1.0", "nonsense")
    loading = load(path, overrides=OverrideOptions(settings, "//"), interfaces=interfaces)
    assert set(errors(loading)) >= {
        *("--set:1 parameter-value", "--set:2 unknown-parameter", "--set:3 unknown-node"),
        *("--set:4 invalid-override", "--namespace:1 invalid-name"),
    }


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("services: {web: {}}\n", "wrong-kind-of-file"),
        ("{}", "wrong-kind-of-file"),
        ("", "yaml-syntax"),
        ("[", None),
        ("\x00", None),
    ],
)
def test_a_file_of_another_kind_has_a_diagnostic_and_no_system(
    tmp_path: Path, interfaces: Interfaces, text: str, rule: str | None
) -> None:
    loading = load(write(tmp_path, text), interfaces=interfaces)
    assert loading.system is None
    assert not loading.is_runnable
    assert len(loading.diagnostics) == 1
    assert rule in {None, loading.diagnostics[0].rule.name}


def test_a_node_type_is_checked_alone(tmp_path: Path, interfaces: Interfaces) -> None:
    path = write(tmp_path, "node: camera\nbehavior: camera:Camera\n", "nodes/camera.yaml")
    loading = load(path, shown="camera.yaml", interfaces=interfaces)
    assert errors(loading) == ["camera.yaml:2 class-missing"]
    (tmp_path / "nodes" / "camera.py").write_text("class Camera: ...\n")
    assert errors(load(path, interfaces=interfaces)) == []


@pytest.mark.parametrize(
    ("port", "rule"),
    [
        ("subscriptions: {s: {type: std_msgs/msg/String}}", "subscription-without-publisher"),
        ("publishers: {p: {type: std_msgs/msg/String, external: true}}", "qos-implicit"),
    ],
)
@pytest.mark.parametrize(("limit", "reported"), [(2, 3), (4, 4)])
def test_what_most_ports_lack_is_reported_a_limited_number_of_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, port: str, rule: str, limit: int, reported: int
) -> None:
    monkeypatch.setattr("composer.rules.analysis.context.MAX_FINDINGS", limit)
    nodes = "".join(f"  node_{number}: {{{port}}}\n" for number in range(4))
    loading = load(write(tmp_path, f"system: robot\nnodes:\n{nodes}"))
    found = [item for item in loading.diagnostics if item.rule.name == rule]
    notes = [item for item in loading.diagnostics if item.rule.name == "too-large"]
    assert len(found) == reported
    assert [item.primary.line for item in notes] == ([5] if reported < 4 else [])
    assert loading.is_runnable


def test_copies_are_at_one_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("composer.rules.analysis.context.MAX_FINDINGS", 2)
    node = "a${i}: {for_each: {i: 4}, publishers: {p: {type: std_msgs/msg/String, topic: 'a${i}'}}}"
    loading = load(write(tmp_path, f"system: robot\nnodes:\n  {node}\n"))
    assert {item.rule.name for item in loading.diagnostics} == {
        "qos-implicit",
        "publisher-without-subscription",
    }
