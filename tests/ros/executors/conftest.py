"""The loop on which a test runs: once of each kind."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.support.loops import KINDS, Bench, bench


@pytest.fixture(params=KINDS)
def on(request: pytest.FixtureRequest) -> Iterator[Bench]:
    with bench(request.param) as running:
        yield running
