"""Projects that ``compose new`` creates run and pass their own tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros.support.commands import output_of


def test_the_tests_of_a_new_project_pass(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    output_of("new", "project", "my_robot")
    monkeypatch.chdir(tmp_path / "my_robot")
    output_of("new", "node", "gripper")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "4 passed" in done.stdout
