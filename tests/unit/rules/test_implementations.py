"""Rules of nodes by what implements them: classes, executables, external nodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import load_project, rules_broken, write_files

NODE = """\
from rclpy.node import Node


class Camera(Node):
    def __init__(self, device):
        super().__init__("camera")
"""


NOT_FOUND = "module '{}' is not found on this computer, so its class is not checked"
EXPECTED = (
    "expected {} next to the YAML file, among the node types, or on Python's module search path"
)


@pytest.mark.parametrize(
    ("module", "message", "hint"),
    [
        ("helpr", "no Python module named 'helpr'", "did you mean 'helper'?"),
        ("drivers.camra", "package 'drivers' has no module 'camra'", "did you mean 'camera'?"),
        ("pytst.node", NOT_FOUND.format("pytst.node"), "did you mean 'pytest'?"),
        ("zzz.node", NOT_FOUND.format("zzz.node"), EXPECTED.format("zzz/node.py")),
        # Not 'tkinter', which has no nodes.
        ("talker", NOT_FOUND.format("talker"), EXPECTED.format("talker.py")),
    ],
)
def test_a_missing_module_is_reported_with_the_nearest_name(
    module: str, message: str, hint: str, tmp_path: Path
) -> None:
    node = f"{{class: '{module}:Camera', arguments: {{device: x}}}}"
    files = {
        "robot.yaml": f"system: robot\nnodes: {{camera: {node}}}\n",
        "composer.yaml": "{}\n",
        "helper.py": NODE,
        "nodes/drivers/__init__.py": "",
        "nodes/drivers/camera.py": NODE,
    }
    (found,) = load_project(tmp_path, files).diagnostics
    rule = "not-installed" if "not found" in message else "class-missing"
    assert (found.rule.name, found.message, found.hint) == (rule, message, hint)


def test_a_source_folder_with_the_name_of_rclpy_is_not_rclpy(tmp_path: Path) -> None:
    text = "system: robot\nnodes: {camera: {class: camera:Camera}}\n"
    files = {"a.yaml": text, "camera.py": NODE}
    (found,) = load_project(tmp_path / "rclpy" / "topics", files).diagnostics
    assert found.message == "the constructor of 'Camera' needs 'device'"


def test_a_type_with_timers_may_be_external_elsewhere(tmp_path: Path) -> None:
    clock = """\
node: clock
publishers: {tick: {type: std_msgs/msg/Empty, qos: command, external: true}}
timers: {tick: {period_ms: 100, publish: {tick: {}}}}
"""
    write_files(tmp_path, {"composer.yaml": "{}\n", "nodes/clock.yaml": clock})
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
