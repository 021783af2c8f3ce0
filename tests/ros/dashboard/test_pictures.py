"""The pictures of the guide are those of the real page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.ros.support.dashboard import Dashboard
from tools.draw_dashboard import FOLDER, PICTURES, ROOT, take

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.browser


def size_of(path: Path) -> tuple[int, int]:
    """Return width and height of a PNG, which are in its first chunk."""
    head = path.read_bytes()[:24]
    assert head.startswith(b"\x89PNG")
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def test_the_guide_shows_every_picture_in_its_present_size() -> None:
    guide = (ROOT / "docs" / "guides" / "dashboard.md").read_text(encoding="utf-8")
    shown = re.findall(r"\(\.\./pictures/(dashboard-[\w.-]+)\)", guide)
    assert sorted(shown) == sorted(picture.name for picture in PICTURES)
    for picture in PICTURES:
        assert size_of(FOLDER / picture.name) == (picture.width, picture.height)


def test_all_pictures_can_be_taken(browser: Browser, server: Dashboard, tmp_path: Path) -> None:
    address = server.address
    take(browser, f"{address.origin}/?token={address.token}", tmp_path, plotted_s=0.0)
    taken = {picture.name: (tmp_path / picture.name).stat().st_size for picture in PICTURES}
    # An empty page is much smaller as a PNG.
    assert min(taken.values()) > 20_000, taken
