"""A system in the background."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from composer.runtime.process.instance_lock import local_systems
from tests.ros.support.background import PLANNER, ROBOT, Robot


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The file of the system; what a failed test leaves in the background is ended."""
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    file = tmp_path / "robot.yaml"
    file.write_text(ROBOT, encoding="utf-8")
    file.with_name("planner.py").write_text(PLANNER, encoding="utf-8")
    yield file
    for pid in local_systems().values():
        with suppress(ProcessLookupError, ValueError):
            os.kill(int(pid), signal.SIGKILL)


@pytest.fixture
def robot(path: Path) -> Iterator[Robot]:
    running = Robot(path)
    yield running
    running.kill()
