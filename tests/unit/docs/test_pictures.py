"""The pictures of the documentation are what the composer draws now."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TOOL = runpy.run_path(str(ROOT / "tools" / "draw_pictures.py"))
DRAWN: dict[str, bytes] = TOOL["pictures"]()


@pytest.mark.parametrize("name", sorted(DRAWN))
def test_a_picture_is_current(name: str) -> None:
    current = (ROOT / "docs" / "pictures" / name).read_bytes()
    assert current == DRAWN[name], "run: make pictures"


def test_no_picture_is_there_that_nobody_draws_or_shows() -> None:
    there = {path.name for path in (ROOT / "docs" / "pictures").iterdir()}
    assert there == set(DRAWN)
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = {
        name
        for page in pages
        for name in re.findall(r"pictures/([\w-]+\.svg)", page.read_text(encoding="utf-8"))
    }
    assert shown == there
