"""Workflows use actions at a commit, with the version in a comment for readers and Dependabot."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FILES = [ROOT / "action.yml", *sorted((ROOT / ".github" / "workflows").glob("*.yml"))]
_PINNED = re.compile(r"[\w-]+/[\w.-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.name)
def test_actions_are_pinned(file: Path) -> None:
    used = re.findall(r"^\s*- uses: (.+)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    assert [action for action in used if action != "./" and not _PINNED.fullmatch(action)] == []
