"""An external node for the tests of running systems."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.context import Context

from tests.ros.support.system_process import ExternalNode


@pytest.fixture(scope="module")
def external_context(shared_domain_id: int) -> Iterator[Context]:
    """One DDS participant for all tests of a module: Fast DDS may crash when deleting many."""
    context = Context()
    rclpy.init(context=context)
    yield context
    rclpy.shutdown(context=context)


@pytest.fixture
def external(external_context: Context) -> Iterator[ExternalNode]:
    """A plain rclpy node in this process, which is external to the system."""
    node = ExternalNode(external_context)
    yield node
    node.close()
