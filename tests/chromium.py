"""A headless Chromium, one for the tests of a file, and what its pages must not do."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import pytest

from tests.programs import require

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

#: The first one is a small program of Debian, which needs two thirds of the processor time.
PROGRAMS = (
    "chromium-headless-shell",
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
)


def chromium() -> str | None:
    """Return the program, or None."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


# Not for all files: until Playwright ends, no test of its process can run an event loop.
@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    program = chromium()
    require(program, "no Chromium is installed")
    require(find_spec("playwright"), "playwright is not installed")
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - not everywhere

    with sync_playwright() as running:
        # Chromium refuses to start as root with its sandbox, and what is opened here is our own.
        browser = running.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


@contextmanager
def without_complaints(page: Page, may_request: Callable[[str], bool]) -> Iterator[Page]:
    """Return a page for the length of the block; it must not complain or request anything else."""
    complaints: list[str] = []
    requests: list[str] = []
    listeners: dict[Any, Callable[[Any], None]] = {
        "console": lambda message: complaints.append(message.text),
        "pageerror": lambda error: complaints.append(str(error)),
        "request": lambda request: requests.append(request.url),
        "websocket": lambda socket: requests.append(socket.url),
    }
    for event, listener in listeners.items():
        page.on(event, listener)
    try:
        yield page
        assert complaints == []
        assert [url for url in requests if not may_request(url)] == []
    finally:
        for event, listener in listeners.items():
            page.remove_listener(event, listener)
