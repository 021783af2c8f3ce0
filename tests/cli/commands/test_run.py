"""``compose run`` and ``compose test`` before ROS starts; tests/ros covers the rest."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.compose import compose, refused, write_files

PIPELINE = "systems/pipeline.yaml"


def test_a_dry_run_prints_the_plan_with_its_causes() -> None:
    done = compose("run", PIPELINE, "--dry-run")
    assert (done.code, done.err) == (0, "")
    assert "#2 configure /planning/planner: motor_controller depends on it\n" in done.out
    assert len(done.out.splitlines()) == 6


def test_options_change_the_plan() -> None:
    options = ("--autostart", "inactive", "--namespace", "/robot1")
    done = compose("run", PIPELINE, "--dry-run", *options)
    assert "activate" not in done.out
    assert "#1 configure /robot1/perception/sensor_simulator: " in done.out
    assert compose("run", PIPELINE, "--dry-run", "--autostart", "unconfigured").out == ""
    assert compose("run", PIPELINE, "--dry-run", "--set", "planner.max_velocity=0.5").code == 0
    message = refused(78, "run", PIPELINE, "--dry-run", "--set", "planner.max_velocty=1.0")
    assert "did you mean 'max_velocity'?" in message


@pytest.mark.parametrize("comment", ["", "  # compose: ignore[unknown-node] two will come"])
def test_a_system_with_errors_is_rejected_even_with_ignore_comments(
    comment: str, folder: Path
) -> None:
    nodes = f"nodes:\n  one: {{lifecycle: {{depends_on: [two]}}}}{comment}\n"
    write_files({"broken.yaml": f"system: broken\n{nodes}"})
    message = refused(78, "run", "broken.yaml", "--dry-run")
    assert "is not a node of this system" in message


def test_paths_that_are_not_files_are_reported(folder: Path) -> None:
    assert compose("run", ".").code == 2
    os.mkfifo("pipe.yaml")
    assert "expected a file, found a pipe" in compose("run", "pipe.yaml").err
    assert "this file cannot be read: File name too long" in refused(78, "run", "a" * 5000)


def test_one_process_alone_starts_no_other(folder: Path) -> None:
    write_files({"robot.yaml": "system: robot\nprocesses: {a: {nodes: [b]}}\nnodes: {b: {}}\n"})
    options = ("--process", "a", "--await-processes", "--dry-run")
    message = refused(2, "run", "robot.yaml", *options)
    assert "--await-processes cannot be used with --process" in message


def test_without_rclpy_the_hint_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("composer.cli.support.ros.find_spec", lambda name: None)
    for command in (["run", PIPELINE], ["lifecycle", "nodes"]):
        assert 'pip install "ros2-composer[ros]"' in refused(1, *command)


SCENARIO = "scenario: starts\nsystem: ../minimal.yaml\nfor_s: 1\nexpect: [{log: started}]\n"


@pytest.fixture
def project(folder: Path) -> None:
    write_files(
        {
            "composer.yaml": "",
            "minimal.yaml": "system: minimal\nnodes: {node: {on_activate: {log: started}}}\n",
            "scenarios/starts.yaml": SCENARIO,
            "empty/note.txt": "",
        }
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["scenario"], "there is no file or folder 'scenario'\n  did you mean 'scenarios'?"),
        (["minimal.yaml"], "'minimal.yaml' is not a scenario\n  a scenario begins with"),
        (["empty"], "there is no scenario in empty"),
        (["-k", "docking and not slow"], "-k 'docking and not slow' selects none of 1 scenarios"),
        (["-k", "docking and"], "-k 'docking and': "),
        (["--explore", "5", "--real-time"], "--explore needs virtual time"),
        (["--explore", "5", "--repeat", "2"], "--explore runs each variation once"),
    ],
)
@pytest.mark.usefixtures("project")
def test_usage_error(arguments: list[str], message: str) -> None:
    assert message in refused(2, "test", *arguments)


@pytest.mark.usefixtures("project")
def test_run_names_the_command_and_validate_checks_the_scenarios_of_a_folder() -> None:
    message = refused(78, "run", "scenarios/starts.yaml", "--dry-run")
    assert "'scenarios/starts.yaml' is a scenario, not a system" in message
    assert "compose test scenarios/starts.yaml" in message
    write_files({"scenarios/starts.yaml": SCENARIO.replace("log:", "message:")})
    done = compose("validate", ".")
    assert done.code == 1
    assert "no node publishes '/started'" in done.out
    assert "2 files checked" in done.err
