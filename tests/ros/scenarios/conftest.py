"""A copy of the example project, for scenarios of tests."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from composer.loading import load
from composer.scenarios.runner import Options, Result, run_scenario

ROOT = Path(__file__).parents[3]
#: Runs a scenario of the project.
Run = Callable[[str], Result]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The folder of the copy."""
    for folder in ("systems", "nodes", "interfaces", "scenarios"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    shutil.copy(ROOT / "composer.yaml", tmp_path)
    return tmp_path


def run(path: Path) -> Result:
    """Run a scenario in this process. Its file has no errors."""
    loaded = load(path)
    assert loaded.scenario is not None, loaded.diagnostics
    assert loaded.system is not None
    return run_scenario(loaded.scenario, loaded.system, Options())
