"""A pipeline, a hand-written node, and a dashboard for all tests of a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import Browser, Dashboard, browser, dashboard
from tests.ros.support.pages import allowed, watched
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


@pytest.fixture
def view(context: sync_api.BrowserContext, server: Dashboard) -> Iterator[sync_api.Page]:
    """A page in a real browser, before it has loaded a view."""
    with watched(context, server.address) as page:
        yield page
