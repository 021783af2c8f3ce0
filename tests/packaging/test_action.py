"""The GitHub action: its steps, run as on a runner."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.packaging.installation import without_ros

ROOT = Path(__file__).parents[2]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS: list[dict[str, Any]] = ACTION["runs"]["steps"]
# The command with which GitHub starts the shell 'bash' of a step.
BASH = ("bash", "--noprofile", "--norc", "-eo", "pipefail", "-c")


def run(name: str, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a step in ``folder``."""
    (step,) = [step for step in STEPS if step.get("name") == name]
    given = {key: variables.get(key, "") for key in step["env"]}
    return subprocess.run(
        [*BASH, step["run"]],
        cwd=folder,
        env=without_ros() | {"GITHUB_ACTIONS": "true"} | variables | given,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def runner_temp(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = str(tmp_path_factory.mktemp("runner"))
    places = {"RUNNER_TEMP": folder, "GITHUB_ACTION_PATH": str(ROOT)}
    done = run("Install compose", ROOT, PYTHON=sys.executable, **places)
    assert done.returncode == 0, done.stderr
    return folder


def test_it_uses_official_actions_and_no_inputs_in_scripts() -> None:
    assert ACTION["runs"]["using"] == "composite"
    for step in STEPS:
        assert step.get("uses", "actions/").startswith("actions/")
        assert "${{" not in step.get("run", "")
        assert ("run" in step) == (step.get("shell") == "bash")
    text = json.dumps(STEPS)
    assert all(f"inputs.{name}" in text for name in ACTION["inputs"])


def test_a_clean_project_passes(runner_temp: str) -> None:
    done = run(
        "Validate", ROOT, RUNNER_TEMP=runner_temp, PATHS="systems\nnodes", OPTIONS="--strict"
    )
    assert (done.returncode, done.stdout) == (0, "")


def test_diagnostics_are_annotations_and_sarif(runner_temp: str, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("system: a\nnodes: {one: {type: rely}}\n")
    done = run("Validate", tmp_path, RUNNER_TEMP=runner_temp, PATHS=".", SARIF_FILE="out.sarif")
    assert done.returncode == 1
    assert done.stdout.startswith("::error file=a.yaml,line=2,")
    (result,) = json.loads((tmp_path / "out.sarif").read_text())["runs"][0]["results"]
    assert result["ruleId"] == "RC201"


def test_an_invalid_option_exits_with_status_2(runner_temp: str) -> None:
    for sarif_file in ("", "out.sarif"):
        done = run(
            "Validate",
            Path(runner_temp),
            RUNNER_TEMP=runner_temp,
            PATHS=str(ROOT / "systems"),
            OPTIONS="--no-such-option",
            SARIF_FILE=sarif_file,
        )
        assert done.returncode == 2


@pytest.mark.ros
def test_scenarios_are_run(tmp_path: Path) -> None:
    (tmp_path / "temp").mkdir()
    (tmp_path / "temp" / "compose").symlink_to(sys.prefix)
    (tmp_path / "s.yaml").write_text("system: s\nnodes: {a: {on_activate: {log: up}}}\n")
    text = "scenario: a\nsystem: s.yaml\nfor_s: 1\nexpect: [{log: down}]\n"
    (tmp_path / "a.yaml").write_text(text)
    done = run(
        "Test", tmp_path, RUNNER_TEMP="temp", SCENARIOS="a.yaml", JUNIT_FILE="out/my results.xml"
    )
    assert done.returncode == 1
    assert "expected: a line 'down' in the log" in done.stdout
    assert (tmp_path / "out" / "my results.xml").exists()
