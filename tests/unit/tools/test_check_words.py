"""The checker of banned words."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "tools" / "check_words.py"
_spec = importlib.util.spec_from_file_location("check_words", SCRIPT)
tool = importlib.util.module_from_spec(_spec)
sys.modules[_spec.name] = tool  # dataclasses look their module up
_spec.loader.exec_module(tool)

BANS = tool.read_bans(
    """
    # a comment
    gizmos? -> device
    out of order -> broken | docs/*.md
    """
)


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("A gizmo.", [(1, 3, "gizmo")]),
        ("one\ntwo GIZMOS", [(2, 5, "gizmos")]),
        ("def start_gizmo(): ...", [(1, 11, "gizmo")]),
        ("class FirstGizmoList: ...", [(1, 12, "gizmo")]),
        ("gizmology, agizmo", []),
        ("gizmo gizmo", [(1, 1, "gizmo"), (1, 7, "gizmo")]),
        ("It is out of order.", [(1, 7, "out of order")]),
        ("# It is out\n    # of order.", [(1, 9, "out # of order")]),
        ("is_out_of_order", [(1, 4, "out_of_order")]),
    ],
)
def test_finds_whole_words_in_prose_and_identifiers(text, places) -> None:
    uses = tool.check("composer/x.py", text, BANS)

    assert [(use.line, use.column, use.word) for use in uses] == places


def test_a_word_is_allowed_in_the_files_that_its_globs_name() -> None:
    assert tool.check("docs/a.md", "out of order", BANS) == []
    assert len(tool.check("docs/a.md", "gizmo", BANS)) == 1


def test_prints_place_word_and_suggestion() -> None:
    (use,) = tool.check("README.md", "a gizmo", BANS)

    assert str(use) == "README.md:1:3: 'gizmo': use device"


def test_a_line_without_a_suggestion_is_an_error() -> None:
    with pytest.raises(ValueError, match="expected 'pattern -> suggestion', not 'gizmo'"):
        tool.read_bans("gizmo")


def test_the_word_list_is_valid() -> None:
    bans = tool.read_bans(tool.WORDS.read_text(encoding="utf-8"))

    assert all(ban.suggestion for ban in bans)
    assert not any(ban.pattern.search("") for ban in bans)


@pytest.fixture
def repository(tmp_path):
    """A git repository with one tracked file in scope, one out of scope, and one untracked file."""
    (tmp_path / "docs").mkdir()
    for name in ("docs/page.md", "docs/untracked.md", "LICENSE"):
        (tmp_path / name).write_text("a gizmo\n", encoding="utf-8")
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    subprocess.run(["git", "add", "docs/page.md", "LICENSE"], cwd=tmp_path, check=True)
    return tmp_path


def test_checks_tracked_files_in_scope(repository) -> None:
    assert tool.tracked_files(repository) == ["docs/page.md"]
    assert tool.tracked_files(repository, ["LICENSE"]) == []
    uses = tool.check_files(repository, ["docs/page.md"], BANS)
    assert [use.path for use in uses] == ["docs/page.md"]
