"""What two computers must have in common, and how differences are reported."""

from __future__ import annotations

import io
import json
import runpy
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from composer.client.hosts import inventory as inventory_module
from composer.client.hosts.inventory import (
    Inventory,
    Question,
    read_answer,
    take_inventory,
    written_question,
)
from composer.loading import load

pytest.importorskip("asyncssh", reason="asyncssh is not installed")
from composer.client.hosts.start import differences, question_about
from tests.unit.support.checking import write_files

HERE = Inventory(
    python="3.11",
    packages={"ros2-composer": "0.1.0", "rclpy": "7.1.6", "ros-jazzy-tf2": "1.0"},
    interfaces={"demo_msgs/msg/Spot": "RIHS01_0123456789abcdef", "a/msg/A": "RIHS01_a"},
    files={"robot.yaml": "11", "nodes/arm.py": "22"},
)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, []),
        ({"python": "3.12"}, ["Python is 3.12 there, 3.11 here"]),
        (
            {"packages": {"ros2-composer": "0.2.0", "rclpy": "7.1.6", "ros-more": "1"}},
            ["ros2-composer is 0.2.0 there, 0.1.0 here"],
        ),
        (
            {"interfaces": {"demo_msgs/msg/Spot": "RIHS01_fedcba98765", "a/msg/A": None}},
            [
                "interface demo_msgs/msg/Spot differs: RIHS01_fedcba9 there, RIHS01_0123456 here",
                "interface a/msg/A is not built there",
            ],
        ),
        ({"files": {"robot.yaml": "12"}}, ["robot.yaml differs", "nodes/arm.py is not there"]),
    ],
)
def test_differences(change: Mapping[str, object], expected: list[str]) -> None:
    there = replace(HERE, **change)  # type: ignore[arg-type]
    assert [item.text for item in differences(HERE, there)] == expected


def test_the_program_answers_with_an_inventory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tmp_path.joinpath("robot.yaml").write_text("system: robot\n", encoding="utf-8")
    question = Question(("robot.yaml", "lost.py"), ("std_msgs/msg/String", "no/msg/Such"))
    tmp_path.joinpath("half-1.0.dist-info").mkdir()  # of an installation that was interrupted
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.StringIO(written_question(question)))
    print("Welcome to this computer", end="")  # a start-up file of the shell
    runpy.run_path(inventory_module.__file__, run_name="__main__")
    found = read_answer(capsys.readouterr().out)
    assert found == take_inventory(tmp_path, question)
    assert found.files["lost.py"] is None
    assert found.interfaces["no/msg/Such"] is None
    assert found.packages["ros2-composer"]


ANSWER = {"python": "3.11", "packages": {}, "interfaces": {}, "files": {}}


@pytest.mark.parametrize(
    "text",
    [
        *("", "hello", "{", "{}", "[]", '{"a":' * 100_000, json.dumps({"python": "3.11"})),
        json.dumps({**ANSWER, "packages": None}),
        json.dumps({**ANSWER, "files": {"robot.yaml": 1}}),
    ],
)
def test_other_output_is_not_an_inventory(text: str) -> None:
    with pytest.raises(ValueError, match="not an inventory"):
        read_answer(text)


def test_the_files_of_a_system(tmp_path: Path) -> None:
    files = {
        "composer.yaml": "",
        "systems/robot.yaml": "system: robot\ninclude: [base.yaml]\nparameter_files: [p.yaml]\n"
        "nodes:\n  arm: {type: arm}\n"
        "  driver: {type: driver}\n",
        "systems/base.yaml": "system: base\nnodes:\n  camera: {on_activate: {log: on}}\n",
        "systems/p.yaml": "/arm:\n  ros__parameters: {speed: 2}\n",
        "systems/other.yaml": "system: other\nnodes:\n  camera: {on_activate: {log: on}}\n",
        "nodes/arm.yaml": "node: arm\nbehavior: arm:Arm\nparameters: {speed: 1}\n"
        "timers: {tick: {period_ms: 10}}\n",
        "nodes/arm.py": "from composer.behavior import Behavior\nfrom motor import turn\n"
        "class Arm(Behavior):\n    def on_tick(self):\n        turn()\n",
        "nodes/motor.py": "def turn() -> None: ...\n",
        "nodes/driver.yaml": "node: driver\nexecutable: {command: [python3, scripts/drive.py]}\n"
        "transforms: {static: {laser: {parent: base, translation_m: {x: 1}}}}\n",
        "nodes/scripts/drive.py": "",
        "nodes/unused.py": "",
    }
    write_files(tmp_path, files)
    path = tmp_path / "systems" / "robot.yaml"
    result = load(path)
    assert result.system is not None
    assert result.is_runnable, result.diagnostics
    unused = {"systems/other.yaml", "nodes/unused.py"}
    question = question_about(result.system, path, result.project)
    assert set(question.files) == set(files) - unused
    assert "tf2_msgs/msg/TFMessage" in question.interfaces
