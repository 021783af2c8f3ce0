"""Nodes by what implements them, and which Python is checked with a node, and how often."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.unit.support.checking import (
    diagnostics_in,
    diagnostics_of_each,
    load_project,
    quoted,
    rules_broken,
    write_files,
)

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
def test_a_missing_module_has_a_hint(module: str, message: str, hint: str, tmp_path: Path) -> None:
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


def test_missing_packages_with_ros_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.prefix", str(tmp_path))
    monkeypatch.setenv("AMENT_PREFIX_PATH", "")
    text = "system: lights\nnodes: {lamp: {executable: {package: lamp_for_mars, name: driver}}}\n"
    assert rules_broken(text, tmp_path) == []
    (tmp_path / "share/ament_index/resource_index/packages").mkdir(parents=True)
    assert rules_broken(text, tmp_path) == ["not-installed"]


SYSTEM = "system: s\nnodes:\n  n: {behavior: robot_code:Code, on_activate: {log: go}}\n"


def test_two_nodes_with_one_class_report_it_once(tmp_path: Path) -> None:
    node = "{behavior: robot_code:Code, timers: {tick: {period_ms: 100}}}"
    files = {
        "demo.yaml": f"system: demo\nnodes:\n  left: {node}\n  right: {node}\n",
        "robot_code.py": "class Code:\n    def on_tick(self):\n"
        "        self.publishers.text.publish(0)\n",
    }
    [diagnostic] = load_project(tmp_path, files).diagnostics
    assert diagnostic.rule.name == "unknown-attribute"


def test_installed_classes_are_not_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    packages = tmp_path / "site-packages"
    code = "class Code:\n    def on_activate(self):\n        self.zebra\n"
    write_files(packages, {"robot_code.py": code})
    monkeypatch.syspath_prepend(packages)
    assert diagnostics_in(SYSTEM, tmp_path) == []


def test_the_modules_that_a_behavior_imports_are_checked_as_well(tmp_path: Path) -> None:
    files = {
        "s.yaml": SYSTEM,
        "robot_code.py": "import helper\nfrom tools import units\nclass Code:\n    pass\n",
        "helper.py": "from tools.units import METER\nfrom math import sqroot\n",
        "tools/__init__.py": "",
        "tools/units.py": "METERS = 3\ndef f():\n    return METRES\n",
        "math.py": "def sqroot(): pass\n",  # does not hide the standard library
        "unused.py": "import nothing\n",
    }
    found = [
        (Path(item.primary.file.path).name, item.primary.line, item.rule.name, item.message)
        for item in load_project(tmp_path, files).diagnostics
    ]
    assert sorted(found) == [
        ("helper.py", 1, "unknown-import", "module 'tools.units' has no 'METER'"),
        ("helper.py", 2, "unknown-import", "could not import 'sqroot' from 'math'"),
        ("units.py", 3, "undefined-name", "could not find name 'METRES'"),
    ]


def test_a_changed_helper_is_read_again(tmp_path: Path) -> None:
    code = "import helper\n\n\nclass Code:\n    def on_configure(self):\n        helper.go()\n"
    helper = "def go(speed: float) -> None: ...\n"
    files = {"s.yaml": SYSTEM, "robot_code.py": code, "helper.py": helper}
    [found] = load_project(tmp_path, files).diagnostics
    assert (found.rule.name, quoted(found)) == ("call-arguments", "()")
    files["helper.py"] = "def go() -> None: ...\n"
    assert load_project(tmp_path, files).diagnostics == []


#: An import, its use, and the attribute that does not exist, if any.
IMPORTED_BY_NAME = [
    ("from datetime import datetime", "datetime.datetime.now()", "datetime"),
    ("from time import time", "time.sleep(1.0)", "sleep"),
    ("from random import random", "random.uniform(0.0, 1.0)", "uniform"),
    ("from datetime import datetime", "datetime.now(), datetime.max.year", ""),
    ("from itertools import chain", "chain.from_iterable([[1]])", ""),
    ("from datetime import datetime", "for datetime in (): print(datetime.text)", ""),
]


def test_what_is_imported_by_name_is_not_its_module(tmp_path: Path) -> None:
    projects = [
        {
            "s.yaml": SYSTEM,
            "robot_code.py": f"{line}\n\n\nclass Code:\n    def go(self):\n        {use}\n",
        }
        for line, use, _ in IMPORTED_BY_NAME
    ]
    for case, found in zip(IMPORTED_BY_NAME, diagnostics_of_each(projects, tmp_path), strict=True):
        reported = [(item.rule.name, quoted(item)) for item in found if item.rule.code != "RC434"]
        assert reported == ([("missing-attribute", case[2])] if case[2] else []), case
