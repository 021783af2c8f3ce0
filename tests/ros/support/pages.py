"""Pages of the dashboard in a browser, and everything they did that they must not do."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any

from tests.chromium import without_complaints
from tests.ros.support.dashboard import Address

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Locator, Page, ViewportSize

PATIENCE_MS = 60_000
SIZE: ViewportSize = {"width": 1280, "height": 800}
VIEWS = ("graph", "nodes", "topics", "services", "parameters", "log", "timing", "bags")
#: What a view shows once its data has arrived.
_READY = (
    ".data tbody tr:visible, .world, .log li, .detail:visible .detail-head, .empty .hint:visible"
)


@contextmanager
def _new_context(browser: Browser, address: Address, options: Any) -> Iterator[BrowserContext]:
    settings: dict[str, Any] = {"viewport": SIZE, **options}
    context = browser.new_context(base_url=address.origin, **settings)
    context.set_default_timeout(PATIENCE_MS)
    try:
        yield context
    finally:
        context.close()


@contextmanager
def allowed(browser: Browser, address: Address) -> Iterator[BrowserContext]:
    """A context for pages at 1280 x 800, which have the cookie of the dashboard."""
    with _new_context(browser, address, {}) as context:
        name, _, value = address.cookie.partition("=")
        context.add_cookies([{"name": name, "value": value, "url": address.origin}])
        key = address.websocket.partition("=")[2]
        context.add_init_script(f"localStorage.setItem('key', '{key}')")
        yield context


def watched(page: Page, address: Address) -> AbstractContextManager[Page]:
    """Return a page for the length of the block.

    At the end, it must not have complained, nor requested anything beyond the server.
    """
    own = (address.origin, f"ws://{address.host}/ws", f"blob:{address.origin}")
    return without_complaints(page, lambda url: url.startswith(own))


@contextmanager
def opened(browser: Browser, address: Address, **options: Any) -> Iterator[Page]:
    """Open the page, as a user does, for the length of the block."""
    with (
        _new_context(browser, address, options) as context,
        watched(context.new_page(), address) as page,
    ):
        page.goto(f"{address.origin}/?token={address.token}")
        yield page


def visit(page: Page, path: str) -> None:
    """Go to a view as a link does, without loading the page again, and wait for its data."""
    page.evaluate("path => history.pushState(null, '', path)", path)
    page.evaluate("dispatchEvent(new PopStateEvent('popstate'))")
    page.locator("#main:not([aria-busy])").wait_for()
    page.locator(_READY).first.wait_for()


def detail(page: Page) -> Locator:
    """Return the details that are shown."""
    return page.locator("aside.detail:visible")


def expect_text(place: Locator, pattern: str) -> None:
    """Wait until an element has a text."""
    place.filter(has_text=re.compile(pattern)).first.wait_for()


def expect_texts(places: Locator, *texts: str) -> None:
    """Wait until the elements are those with these texts."""
    from playwright.sync_api import expect  # noqa: PLC0415 - not everywhere

    expect(places).to_have_text(list(texts), timeout=PATIENCE_MS)
