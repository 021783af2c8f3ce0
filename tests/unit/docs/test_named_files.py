"""Documents for contributors name files that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import composer

ROOT = Path(__file__).parents[3]
PAGES = [
    ROOT / "ARCHITECTURE.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs" / "decisions").glob("*.md")),
]
#: The package as it is installed: the tests of a wheel have no other.
PACKAGE = Path(composer.__file__).parent
_PATH = re.compile(r"`([\w./-]+/|[\w./-]+\.(?:py|yaml|yml|txt|xml|json|toml|md))`")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_files_exist(page: Path) -> None:
    named = set(_PATH.findall(page.read_text(encoding="utf-8")))
    # Paths may leave out the first folders: `supervision/events.py`, `loading.py`.
    missing = [path for path in named if not _exists(path)]
    assert missing == []


def _exists(path: str) -> bool:
    inner = path.removeprefix("composer/")
    return (ROOT / path).exists() or any(PACKAGE.rglob(f"**/{inner}"))
