"""Pages in a headless Chromium: a fresh context for each test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.browser)


@dataclass
class Opened:
    """Files in the browser, and everything they did that a file of ours must not do."""

    page: Page
    files: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def go(self, path: Path) -> None:
        """Open a file in place of the one before."""
        self.files.append(path.as_uri())
        self.page.goto(path.as_uri())


@pytest.fixture
def open_file(browser: Browser) -> Iterator[Callable[..., Opened]]:
    """Opens a file; at the end no file may have complained or asked for anything else."""
    contexts = []
    opened_files: list[Opened] = []

    def open_it(path: Path, **options: Any) -> Opened:
        context = browser.new_context(viewport={"width": 1280, "height": 800}, **options)
        contexts.append(context)
        page = context.new_page()
        opened = Opened(page)
        opened_files.append(opened)
        page.on("console", lambda message: opened.complaints.append(message.text))
        page.on("pageerror", lambda error: opened.complaints.append(str(error)))
        page.on("request", lambda request: opened.requests.append(request.url))
        opened.go(path)
        return opened

    yield open_it
    for opened in opened_files:
        assert opened.complaints == []
        assert opened.requests == opened.files
    for context in contexts:
        context.close()
