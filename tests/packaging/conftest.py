"""Fixtures: the wheel, built once, and an environment in which only the wheel is installed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.packaging.installation import ROOT, Installation, run_step, without_ros

HERE = Path(__file__).parent
PIP = ("-m", "pip", "--disable-pip-version-check")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.slow)
            item.add_marker(pytest.mark.timeout(300))


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, *PIP, "wheel", "-qq", "--no-deps", "--wheel-dir", folder, ROOT]
    subprocess.run(command, env=without_ros(), check=True)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="session")
def installation(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """The environment that the GitHub action makes, with the wheel and its dependencies."""
    folder = tmp_path_factory.mktemp("runner")
    places = {"RUNNER_TEMP": str(folder), "GITHUB_ACTION_PATH": str(wheel)}
    done = run_step("Install compose", ROOT, PYTHON=sys.executable, **places)
    assert done.returncode == 0, done.stderr
    return Installation(folder / "compose", tmp_path_factory.mktemp("elsewhere"))
