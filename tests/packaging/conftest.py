"""Fixtures: the wheel, built once, and an environment in which only the wheel is installed."""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path

import pytest

from tests.packaging.installation import Installation, without_ros

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PIP = ("-m", "pip", "--disable-pip-version-check")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.slow)
            item.add_marker(pytest.mark.timeout(300))


def _pip(python: Path | str, *arguments: str | Path) -> None:
    subprocess.run([python, *PIP, *arguments], env=without_ros(), check=True)


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    _pip(sys.executable, "wheel", "-qq", "--no-deps", "--wheel-dir", folder, ROOT)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="session")
def installation(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """An environment with the wheel and its dependencies."""
    environment = tmp_path_factory.mktemp("environment")
    venv.create(environment, symlinks=True)
    _pip(sys.executable, "--python", environment, "install", "-qq", wheel)
    return Installation(environment, tmp_path_factory.mktemp("elsewhere"))
