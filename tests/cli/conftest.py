"""What the tests of commands share."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.compose import compose


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def project(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new project, which is the current folder."""
    done = compose("new", "project", "my_robot")
    assert done.code == 0, done.err
    assert "my_robot/systems/my_robot.yaml" in done.out.splitlines()
    monkeypatch.chdir(folder / "my_robot")
    return folder / "my_robot"
