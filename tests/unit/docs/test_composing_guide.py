"""The files in the guide to composing systems are valid."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.loading import load

GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "composing.md"
BLOCKS = re.findall(r"```yaml\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
HEADS = ("", "", "system: changed\nexecutors: {slow: {}}\n", "", "")
NAMES = ("fleet.yaml", "robot.yaml", "changed.yaml", "cameras.yaml", "nodes/slow_planner.yaml")


@pytest.mark.parametrize("name", NAMES)
def test_the_file_is_valid(tmp_path: Path, name: str) -> None:
    (tmp_path / "nodes").mkdir()
    for other, head, block in zip(NAMES, HEADS, BLOCKS, strict=True):
        (tmp_path / other).write_text(head + block, encoding="utf-8")
    assert [item.message for item in load(tmp_path / name).diagnostics] == []
