"""Files of ours in a headless Chromium."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.chromium import without_complaints

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, ViewportSize

HERE = Path(__file__).parent
SIZE: ViewportSize = {"width": 1280, "height": 800}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="module")
def shared_page(browser: Browser) -> Iterator[Page]:
    """The page of all tests of a file: a new one takes ten times as long to open a file."""
    page = browser.new_page(viewport=SIZE)
    yield page
    page.close()


@pytest.fixture
def open_file(browser: Browser, shared_page: Page) -> Iterator[Callable[..., Page]]:
    """Opens a file; at the end no file may have complained or asked for anything else.

    A file with options gets a page of its own. Without, the files of a test share one.
    """
    files: set[str] = set()
    with ExitStack() as stack:
        stack.enter_context(without_complaints(shared_page, files.__contains__))

        def open_it(path: Path, **options: Any) -> Page:
            page = shared_page
            if options:
                page = stack.enter_context(browser.new_page(viewport=SIZE, **options))
                stack.enter_context(without_complaints(page, files.__contains__))
            page.set_viewport_size(SIZE)
            page.mouse.move(0, 0)
            files.add(path.as_uri())
            page.goto(path.as_uri())
            return page

        yield open_it
