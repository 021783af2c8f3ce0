"""The files in the guide to composing systems are valid."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from composer.loading import load_files
from composer.model.resolve.parameter_files import ParameterFiles, read_parameter_file

GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "composing.md"
BLOCKS = re.findall(r"```yaml\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
HEADS = ("", "", "", "system: changed\nexecutors: {slow: {}}\n", "", "", "")
PARAMETERS = "config/robot.yaml"
SYSTEMS = (
    "fleet.yaml",
    "robot.yaml",
    "changed.yaml",
    "cameras.yaml",
    "mapping.yaml",
    "nodes/slow_planner.yaml",
)
NAMES = (*SYSTEMS[:2], PARAMETERS, *SYSTEMS[2:])


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_file_is_valid(tmp_path: Path, name: str) -> None:
    for folder in ("nodes", "config"):
        (tmp_path / folder).mkdir()
    for other, head, block in zip(NAMES, HEADS, BLOCKS, strict=True):
        (tmp_path / other).write_text(head + block, encoding="utf-8")
    [result] = load_files([tmp_path / name])
    assert [item.message for item in result.diagnostics] == []


def test_the_parameter_file_is_valid(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(BLOCKS[NAMES.index(PARAMETERS)], encoding="utf-8")
    files = ParameterFiles()
    assert read_parameter_file(tmp_path / "robot.yaml", files) == []
    assert [section.name.value for section in files.sections] == ["/**", "/alpha/planner"]
