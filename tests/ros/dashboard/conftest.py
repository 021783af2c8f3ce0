"""A pipeline, a hand-written node, and a dashboard for all tests of a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import Browser, Dashboard, browser, dashboard
from tests.ros.support.pages import SIZE, allowed, watched
from tests.ros.support.system_process import REPOSITORY, RunningSystem

if TYPE_CHECKING:
    from playwright import sync_api

FILE = "systems/pipeline.yaml"


@pytest.fixture(scope="module")
def pipeline(shared_domain_id: int) -> Iterator[RunningSystem]:
    """The example pipeline, up, and the node ``/lab/talker``."""
    with RunningSystem(FILE) as system, hand_written("hand_written_talker.py"):
        system.wait_for("3 of 3 nodes active")
        yield system


@pytest.fixture(scope="module")
def server(pipeline: RunningSystem) -> Iterator[Dashboard]:
    """A dashboard that knows the file of the pipeline."""
    with dashboard(FILE, cwd=REPOSITORY) as running:
        yield running


@pytest.fixture
def page(server: Dashboard) -> Iterator[Browser]:
    """A connection to the dashboard."""
    with browser(server.address) as opened:
        yield opened


@pytest.fixture(scope="module")
def context(browser: sync_api.Browser, server: Dashboard) -> Iterator[sync_api.BrowserContext]:
    """What all pages of a file share: the cookie, and the files of the page."""
    with allowed(browser, server.address) as shared:
        yield shared


@pytest.fixture(scope="module")
def shared_page(context: sync_api.BrowserContext) -> sync_api.Page:
    """The page of most tests of a file: a new one starts a process and compiles all scripts."""
    return context.new_page()


@pytest.fixture
def view(shared_page: sync_api.Page, server: Dashboard) -> Iterator[sync_api.Page]:
    """The page, which shows what the test before has left: a test begins with ``goto``."""
    shared_page.set_viewport_size(SIZE)
    shared_page.emulate_media(color_scheme="light")
    with watched(shared_page, server.address) as page:
        yield page


@pytest.fixture
def own_view(context: sync_api.BrowserContext, server: Dashboard) -> Iterator[sync_api.Page]:
    """A page before it has loaded a view, for a test that changes its way to the server."""
    with watched(context.new_page(), server.address) as page:
        yield page
    page.close()
