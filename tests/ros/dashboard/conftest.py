"""A pipeline, a hand-written node, and a dashboard for all tests of a file."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.support.commands import hand_written
from tests.ros.support.dashboard import Browser, Dashboard, browser, dashboard
from tests.ros.support.system_process import REPOSITORY, RunningSystem

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
