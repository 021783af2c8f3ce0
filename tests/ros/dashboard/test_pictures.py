"""The files of the page, and the pictures of the guide, which show the real page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from composer.dashboard.web.app import VIEWS, file_of_page, index_of
from tests.ros.support.dashboard import Dashboard
from tools.draw_dashboard import FOLDER, PICTURES, ROOT, take

if TYPE_CHECKING:
    from playwright.sync_api import Browser

_LINK = re.compile(r'<link rel="modulepreload" href="/page/([^"]+)">')


@pytest.mark.parametrize("view", ["", *VIEWS])
def test_every_view_names_its_modules_so_that_they_are_loaded_at_once(view: str) -> None:
    modules = _LINK.findall(index_of(view).decode())
    assert len(set(modules)) == len(modules)
    assert {"main.js", "dom.js", "connection.js"} <= set(modules)
    assert all(file_of_page(name).is_file() for name in modules)
    assert ("graph/viewport.js" in modules) == (view in ("", "graph"))


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


@pytest.mark.browser
def test_all_pictures_can_be_taken(browser: Browser, server: Dashboard, tmp_path: Path) -> None:
    address = server.address
    take(browser, f"{address.origin}/?token={address.token}", tmp_path, plotted_s=0.0)
    taken = {picture.name: (tmp_path / picture.name).stat().st_size for picture in PICTURES}
    # An empty page is much smaller as a PNG.
    assert min(taken.values()) > 20_000, taken
