"""The wheel, installed by the GitHub action, with and without ROS; the steps of the action."""

from __future__ import annotations

import json
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from composer.bridges.export.container_image import wheel as composer_wheel
from tests.packaging.installation import (
    ACTION,
    ROOT,
    STEPS,
    Installation,
    run_step,
    with_this_ros,
    without_ros,
)


def test_the_wheel_contains_all_shared_files_and_no_others(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    for path in (
        "composer/py.typed",
        "composer/python_code/stubs/libraries/rclpy/node.pyi",
        "composer/share/interfaces/action/Navigate.action",
        "composer/share/nodes/planner.py",
        "composer/share/nodes/planner.yaml",
        "composer/share/rules/RC311.md",
        "composer/share/schemas/system.schema.json",
        "composer/share/systems/pipeline.yaml",
        "composer/graph/formats/html/main.js",
        "composer/graph/formats/html/page.css",
        "composer/graph/formats/html/page.html",
        "composer/dashboard/page/index.html",
        "composer/dashboard/page/views/graph.js",
        "composer/dashboard/page/vendor/uplot/uPlot.esm.js",
    ):
        assert path in names
    licenses = [name.partition("/licenses/")[2] for name in names if "/licenses/" in name]
    assert {"LICENSE", "THIRD_PARTY.md"} <= set(licenses)
    assert [name for name in licenses if name.endswith("vendor/uplot/LICENSE")]
    assert [name for name in names if "__pycache__" in name or name.startswith("tests/")] == []


def test_the_wheel_of_images_is_the_same(wheel: Path, tmp_path: Path) -> None:
    """That of ``compose export docker-compose``, made of the files of an installation."""
    name, data = composer_wheel("ros2-composer")
    (tmp_path / name).write_bytes(data)
    built, packed = zipfile.ZipFile(wheel), zipfile.ZipFile(tmp_path / name)
    assert name == wheel.name
    assert sorted(packed.namelist()) == sorted(built.namelist())
    for path in built.namelist():
        if path.startswith("composer/"):
            assert packed.read(path) == built.read(path), path


@pytest.mark.parametrize(
    ("command", "code", "shown"),
    [
        ("compose --version", 0, version("ros2-composer")),
        ("python -m rclpy", 1, "No module named rclpy"),
        ("compose validate SHARE/systems SHARE/nodes", 0, ""),
        ("compose validate broken.yaml", 1, "did you mean 'planner'?"),
        ("compose graph SHARE/systems/pipeline.yaml", 0, "motor_controller"),
    ],
)
def test_commands_without_ros(
    command: str, code: int, shown: str, installation: Installation
) -> None:
    broken = installation.elsewhere / "broken.yaml"
    broken.write_text("system: broken\nnodes:\n  planner: {type: planer}\n", "utf-8")
    words = command.replace("SHARE", str(installation.package / "share")).split()
    done = installation.run(*words, variables=without_ros())
    assert done.returncode == code, done.stdout + done.stderr
    assert shown in done.stdout + done.stderr


@pytest.mark.ros
def test_a_shipped_system_runs_with_ros(installation: Installation) -> None:
    variables = with_this_ros()
    where = "import composer, rclpy; print(composer.__file__)"
    done = installation.run("python", "-c", where, variables=variables)
    assert Path(done.stdout.strip()).is_relative_to(installation.package), done.stderr
    system = installation.package / "share" / "systems" / "pipeline.yaml"
    done = installation.run("compose", "run", system, "--for", "2", variables=variables)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr


def test_it_uses_official_actions_and_no_inputs_in_scripts() -> None:
    assert ACTION["runs"]["using"] == "composite"
    for step in STEPS:
        assert step.get("uses", "actions/").startswith("actions/")
        assert "${{" not in step.get("run", "")
        assert ("run" in step) == (step.get("shell") == "bash")
    text = json.dumps(STEPS)
    assert all(f"inputs.{name}" in text for name in ACTION["inputs"])


def test_files_are_validated_by_the_action(installation: Installation, tmp_path: Path) -> None:
    done = installation.validate(ROOT, "systems\nnodes", OPTIONS="--strict")
    assert (done.returncode, done.stdout) == (0, "")
    (tmp_path / "a.yaml").write_text("system: a\nnodes: {one: {type: rely}}\n")
    done = installation.validate(tmp_path, ".", SARIF_FILE="out.sarif")
    assert done.returncode == 1
    assert done.stdout.startswith("::error file=a.yaml,line=2,")
    (result,) = json.loads((tmp_path / "out.sarif").read_text())["runs"][0]["results"]
    assert result["ruleId"] == "RC201"
    for sarif_file in ("", "out.sarif"):
        options = {"OPTIONS": "--no-such-option", "SARIF_FILE": sarif_file}
        done = installation.validate(installation.elsewhere, str(ROOT / "systems"), **options)
        assert done.returncode == 2


@pytest.mark.ros
def test_scenarios_are_run(tmp_path: Path) -> None:
    (tmp_path / "temp").mkdir()
    (tmp_path / "temp" / "compose").symlink_to(sys.prefix)
    (tmp_path / "s.yaml").write_text("system: s\nnodes: {a: {on_activate: {log: up}}}\n")
    text = "scenario: a\nsystem: s.yaml\nfor_s: 1\nexpect: [{log: down}]\n"
    (tmp_path / "a.yaml").write_text(text)
    done = run_step(
        "Test", tmp_path, RUNNER_TEMP="temp", SCENARIOS="a.yaml", JUNIT_FILE="out/my results.xml"
    )
    assert done.returncode == 1
    assert "expected: a line 'down' in the log" in done.stdout
    assert (tmp_path / "out" / "my results.xml").exists()
