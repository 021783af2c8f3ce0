"""The notes of a release are its section of the changelog."""

from __future__ import annotations

import runpy
from pathlib import Path

section = runpy.run_path(str(Path(__file__).parents[3] / "tools" / "release_notes.py"))["section"]
CHANGELOG = """# Changelog

## [Unreleased]

- Not yet.

## [0.2.0] - 2026-05-01

### Added

- Second.

## [0.1.0] - 2026-04-01

- First.

[0.1.0]: https://example.org
"""


def test_it_ends_before_the_next_version() -> None:
    assert section(CHANGELOG, "0.2.0") == "### Added\n\n- Second."


def test_it_ends_before_the_links() -> None:
    assert section(CHANGELOG, "0.1.0") == "- First."


def test_a_version_without_a_section_has_no_notes() -> None:
    assert section(CHANGELOG, "0.3.0") is None
