"""Rules of nodes by what implements them: classes, executables, external nodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import diagnostics_in, rules_broken

NODE = """\
from rclpy.node import Node


class Camera(Node):
    def __init__(self, device):
        super().__init__("camera")
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "composer.yaml").write_text("{}\n")
    package = tmp_path / "nodes" / "drivers"
    package.mkdir(parents=True)
    (tmp_path / "helper.py").write_text(NODE)
    (package / "__init__.py").write_text("")
    (package / "camera.py").write_text(NODE)
    return tmp_path


@pytest.mark.parametrize(
    ("reference", "rule", "message", "hint"),
    [
        (
            "helpr:Camera",
            "class-missing",
            "no Python module named 'helpr'",
            "did you mean 'helper'?",
        ),
        (
            "drivers.camra:Camera",
            "class-missing",
            "package 'drivers' has no module 'camra'",
            "did you mean 'camera'?",
        ),
        (
            "pytst.node:Camera",
            "not-installed",
            "module 'pytst.node' is not found on this computer, so its class is not checked",
            "did you mean 'pytest'?",
        ),
        (
            "zzz.node:Camera",
            "not-installed",
            "module 'zzz.node' is not found on this computer, so its class is not checked",
            "expected zzz/node.py next to the YAML file, among the node types, or on Python's"
            " module search path",
        ),
        (  # not 'tkinter', which has no nodes
            "talker:Camera",
            "not-installed",
            "module 'talker' is not found on this computer, so its class is not checked",
            "expected talker.py next to the YAML file, among the node types, or on Python's"
            " module search path",
        ),
    ],
)
def test_a_missing_module_is_reported_with_the_nearest_name(
    folder: Path, reference: str, rule: str, message: str, hint: str
) -> None:
    text = f"system: robot\nnodes: {{camera: {{class: '{reference}', arguments: {{device: x}}}}}}\n"
    (found,) = diagnostics_in(text, folder)
    assert (found.rule.name, found.message, found.hint) == (rule, message, hint)


def test_a_source_folder_with_the_name_of_rclpy_is_not_rclpy(tmp_path: Path) -> None:
    folder = tmp_path / "rclpy" / "topics"
    folder.mkdir(parents=True)
    (folder / "camera.py").write_text(NODE)
    text = "system: robot\nnodes: {camera: {class: camera:Camera}}\n"
    (found,) = diagnostics_in(text, folder)
    assert found.message == "the constructor of 'Camera' needs 'device'"


def test_a_type_with_timers_may_be_external_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "composer.yaml").write_text("{}\n")
    (tmp_path / "nodes").mkdir()
    (tmp_path / "nodes" / "clock.yaml").write_text(
        "node: clock\n"
        "publishers: {tick: {type: std_msgs/msg/Empty, qos: command, external: true}}\n"
        "timers: {tick: {period_ms: 100, publish: {tick: {}}}}\n"
    )
    text = "system: robot\nnodes: {clock: {type: clock, external: true%s}}\n"
    assert rules_broken(text % "", tmp_path) == []
    assert rules_broken(text % ", log_level: debug", tmp_path) == ["setting-without-effect"]


def test_missing_packages_are_reported_where_ros_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.prefix", str(tmp_path))
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    text = "system: lights\nnodes: {lamp: {executable: {package: lamp_for_mars, name: driver}}}\n"
    assert rules_broken(text, tmp_path) == []

    (tmp_path / "share/ament_index/resource_index/packages").mkdir(parents=True)
    assert rules_broken(text, tmp_path) == ["not-installed"]
