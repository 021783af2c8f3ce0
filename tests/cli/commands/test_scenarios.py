"""``compose test``: what it selects, and what is a usage error. Needs no ROS."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.compose import compose, write_files

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
    done = compose("test", *arguments)
    assert done.code == 2
    assert message in done.err


@pytest.mark.usefixtures("project")
def test_run_names_the_command_and_validate_checks_the_scenarios_of_a_folder() -> None:
    done = compose("run", "scenarios/starts.yaml", "--dry-run")
    assert done.code == 78
    assert "'scenarios/starts.yaml' is a scenario, not a system" in done.err
    assert "compose test scenarios/starts.yaml" in done.err
    write_files({"scenarios/starts.yaml": SCENARIO.replace("log:", "message:")})
    done = compose("validate", ".")
    assert done.code == 1
    assert "no node publishes '/started'" in done.out
    assert "2 files checked" in done.err
