"""docs/language.md and the diagrams are up to date, and the links in docs/ are valid."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

from composer.base.source import SourceFile
from composer.language.document import parse_document
from composer.language.schema import SCHEMAS, check_schema, kind_of, schema

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
GUIDES = sorted((ROOT / "docs").rglob("*.md"))
TOOL = runpy.run_path(str(ROOT / "tools" / "draw_pictures.py"))
PICTURES: dict[str, tuple[str, str]] = TOOL["PICTURES"]


def test_the_page_is_up_to_date() -> None:
    page = runpy.run_path(str(ROOT / "tools" / "write_language.py"))["page"]()
    assert page == PAGE, "run: make generate"


@pytest.mark.parametrize("name", SCHEMAS)
def test_every_key_has_a_row(name: str) -> None:
    def keys(part: Any) -> set[str]:
        if isinstance(part, list):
            return set().union(*map(keys, part))
        if not isinstance(part, dict):
            return set()
        inner = [value for key, value in part.items() if key not in ("examples", "default")]
        return set(part.get("properties", {})) | set().union(*map(keys, inner))

    assert {key for key in keys(schema(name)) if f"| `{key}` |" not in PAGE} == set()


def test_the_example_is_valid() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    tree, diagnostics = parse_document(SourceFile("example", example))
    assert tree is not None
    assert [*diagnostics, *check_schema(tree, str(kind_of(tree)))] == []


def test_links_are_valid() -> None:
    for page in GUIDES:
        text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if target.startswith("https://"):
                continue
            path, _, anchor = target.partition("#")
            other = page.parent / path if path else page
            assert other.exists(), (page, target)
            assert not anchor or anchor in anchors(other), (page, target)


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives to the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("name", sorted(PICTURES))
def test_a_picture_is_up_to_date(name: str) -> None:
    current = (ROOT / "docs" / "pictures" / name).read_bytes()
    assert current == TOOL["drawn"](*PICTURES[name]), "run: make generate"


def test_all_pictures_are_generated_and_used() -> None:
    # Pictures of the dashboard are PNGs: see tests/ros/dashboard/test_accessibility.py.
    files = {path.name for path in (ROOT / "docs" / "pictures").glob("*.svg")}
    # "editor-python.svg": see tests/language_server. "terminal.svg" shows the times of one run.
    assert files == {*PICTURES, "editor-python.svg", "terminal.svg"}
    shown = {
        name
        for page in (ROOT / "README.md", *GUIDES)
        for name in re.findall(r"pictures/([\w-]+\.svg)", page.read_text(encoding="utf-8"))
    }
    assert shown == files
