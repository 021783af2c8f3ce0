"""The diagrams in the documentation are up to date, and all of them are used."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TOOL = runpy.run_path(str(ROOT / "tools" / "draw_pictures.py"))
PICTURES: dict[str, tuple[str, str]] = TOOL["PICTURES"]


@pytest.mark.parametrize("name", sorted(PICTURES))
def test_a_picture_is_up_to_date(name: str) -> None:
    current = (ROOT / "docs" / "pictures" / name).read_bytes()
    assert current == TOOL["drawn"](*PICTURES[name]), "run: make generate"


def test_all_pictures_are_generated_and_used() -> None:
    # Pictures of the dashboard are PNGs: see tests/ros/dashboard/test_pictures.py.
    files = {path.name for path in (ROOT / "docs" / "pictures").glob("*.svg")}
    # "editor-python.svg": see tests/language_server. "terminal.svg" shows the times of one run.
    assert files == {*PICTURES, "editor-python.svg", "terminal.svg"}
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = {
        name
        for page in pages
        for name in re.findall(r"pictures/([\w-]+\.svg)", page.read_text(encoding="utf-8"))
    }
    assert shown == files
