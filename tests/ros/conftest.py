"""Fixtures of the tests on real DDS."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.system_bench import Peer


@pytest.fixture
def peer() -> Iterator[Peer]:
    """A hand-written node in a participant of its own."""
    node = Peer()
    try:
        yield node
    finally:
        node.close()
