"""The next coordinating process uses the goals that the last one has kept."""

from __future__ import annotations

from pathlib import Path

import pytest

from composer.model import PrimaryState
from composer.runtime.members.kept_goals import KeptGoals
from tests.unit.support.resolving import system_of

ACTIVE, INACTIVE = PrimaryState.ACTIVE, PrimaryState.INACTIVE
BOTH = {"arm": ACTIVE, "eye": INACTIVE}


def goals_of(path: Path | None, nodes: str = "arm: {}, eye: {}") -> KeptGoals:
    return KeptGoals(system_of(f"{{system: robot, nodes: {{{nodes}}}}}"), path)


def test_goals_are_kept_until_the_system_is_shut_down(tmp_path: Path) -> None:
    path = tmp_path / "robot.goals"
    goals = goals_of(path)
    assert goals.read() is None
    goals.keep(BOTH, "running")
    goals.keep(BOTH, "paused")
    assert goals_of(path).read() == (BOTH, "paused")
    gone = goals_of(path, "eye: {}, leg: {}")
    assert gone.read() == ({"eye": INACTIVE}, "paused"), "nodes that are gone do not count"
    goals.forget()
    goals.forget()
    assert goals_of(path).read() is None


@pytest.mark.parametrize("text", ["", "{}", "\xff", '{"version": 0, "type": "x", "content": {}}'])
def test_a_file_that_cannot_be_read_does_not_count(text: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.goals"
    path.write_text(text, encoding="latin-1")
    assert goals_of(path).read() is None


def test_without_a_folder_nothing_is_kept(tmp_path: Path) -> None:
    for path in (None, tmp_path / "missing" / "robot.goals"):
        goals = goals_of(path)
        goals.keep(BOTH, "running")
        goals.forget()
        assert goals.read() is None
