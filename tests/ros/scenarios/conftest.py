"""A copy of the example project, for scenarios of tests."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from composer.loading import load
from composer.scenarios.runner import Options, Result, run_scenario
from tests.ros.support.forked import ForkedCommand

ROOT = Path(__file__).parents[3]


def copied_to(path: Path) -> Path:
    """Copy the project into an empty folder; return the folder."""
    for folder in ("systems", "nodes", "interfaces", "scenarios"):
        shutil.copytree(ROOT / folder, path / folder)
    shutil.copy(ROOT / "composer.yaml", path)
    return path


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The folder of the copy."""
    return copied_to(tmp_path)


def run(path: Path) -> Result:
    """Run a scenario in this process. Its file has no errors."""
    loaded = load(path)
    assert loaded.scenario is not None, loaded.diagnostics
    assert loaded.system is not None
    return run_scenario(loaded.scenario, loaded.system, Options())


def compose_in(folder: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder; return its result, whatever the exit code."""
    process = ForkedCommand(*map(str, arguments), cwd=folder)
    output, error = process.communicate(timeout=150.0)
    return subprocess.CompletedProcess(process.args, process.wait(), output, error)
