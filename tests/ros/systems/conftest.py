"""Somebody outside, for the tests that look at a running system."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.systems.running import Outsider


@pytest.fixture
def outsider() -> Iterator[Outsider]:
    """A node of an ordinary rclpy process."""
    node = Outsider()
    yield node
    node.close()
