"""Somebody outside, for the tests that look at a running system."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.context import Context

from tests.ros.support.system_process import Outsider


@pytest.fixture(scope="module")
def outside(shared_domain_id: int) -> Iterator[Context]:
    """One DDS participant for many tests: Fast DDS has crashed on deleting many in a row."""
    context = Context()
    rclpy.init(context=context)
    yield context
    rclpy.shutdown(context=context)


@pytest.fixture
def outsider(outside: Context) -> Iterator[Outsider]:
    """A node of an ordinary rclpy process."""
    node = Outsider(outside)
    yield node
    node.close()
