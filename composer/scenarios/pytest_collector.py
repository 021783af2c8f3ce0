"""Lets pytest collect scenarios: YAML files in a folder ``scenarios`` of a project.

Each runs in a process of its own, by ``compose test``.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

_MARKER = re.compile(rb"^scenario\s*:", re.MULTILINE)
_FOLDER = "scenarios"


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Return the collector of a scenario; None for other files."""
    if file_path.suffix not in (".yaml", ".yml") or not _is_scenario(file_path):
        return None
    collector: pytest.Collector = ScenarioFile.from_parent(parent, path=file_path)
    return collector


def _is_scenario(path: Path) -> bool:
    if _MARKER.search(path.read_bytes()) is None:
        return False
    from composer.project import Project  # noqa: PLC0415 - only where there are scenarios

    root = Project.at(path.parent).root
    return _FOLDER in (path.parent.name, *path.resolve().relative_to(root).parent.parts)


class ScenarioFile(pytest.File):
    """A file with a scenario."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the scenario."""
        yield ScenarioItem.from_parent(self, name=self.path.stem)


class ScenarioFailed(Exception):
    """A scenario has failed; the text is what ``compose test`` has printed."""


class ScenarioItem(pytest.Item):
    """A scenario as a test."""

    def runtest(self) -> None:
        """Run the scenario. Raises ScenarioFailed."""
        if find_spec("rclpy") is None:
            pytest.skip("ROS 2 is not installed")
        command = [sys.executable, "-m", "composer", "test", str(self.path)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
        if done.returncode != 0:
            raise ScenarioFailed(done.stdout + done.stderr)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], *_: Any) -> Any:
        """Return the text of a failure, without a traceback of Python."""
        if isinstance(excinfo.value, ScenarioFailed):
            return str(excinfo.value).rstrip()
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return the place of the scenario."""
        return self.path, 0, f"scenario {self.name}"
