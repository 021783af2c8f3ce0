"""Files of ours in a headless Chromium."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, ViewportSize

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.browser)


SIZE: ViewportSize = {"width": 1280, "height": 800}


@dataclass
class Opened:
    """Files in the browser, and everything they did that a file of ours must not do."""

    page: Page
    files: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._listeners: dict[Any, Callable[[Any], None]] = {
            "console": lambda message: self.complaints.append(message.text),
            "pageerror": lambda error: self.complaints.append(str(error)),
            "request": lambda request: self.requests.append(request.url),
        }
        for event, listener in self._listeners.items():
            self.page.on(event, listener)

    def go(self, path: Path) -> None:
        """Open a file in place of the one before."""
        self.files.append(path.as_uri())
        self.page.goto(path.as_uri())

    def check(self) -> None:
        """Check that no file has complained or asked for anything else."""
        for event, listener in self._listeners.items():
            self.page.remove_listener(event, listener)
        assert self.complaints == []
        assert self.requests == self.files


@pytest.fixture(scope="module")
def shared_page(browser: Browser) -> Iterator[Page]:
    """The page of all tests of a file: a new one takes ten times as long to open a file."""
    page = browser.new_page(viewport=SIZE)
    yield page
    page.close()


@pytest.fixture
def open_file(browser: Browser, shared_page: Page) -> Iterator[Callable[..., Opened]]:
    """Opens a file; at the end no file may have complained or asked for anything else.

    A file with options gets a page of its own. Without, the files of a test share one.
    """
    opened_files: list[Opened] = []

    def open_it(path: Path, **options: Any) -> Opened:
        page = browser.new_page(viewport=SIZE, **options) if options else shared_page
        page.set_viewport_size(SIZE)
        page.mouse.move(0, 0)
        opened = Opened(page)
        opened_files.append(opened)
        opened.go(path)
        return opened

    yield open_it
    for opened in opened_files:
        opened.check()
        if opened.page is not shared_page:
            opened.page.close()
