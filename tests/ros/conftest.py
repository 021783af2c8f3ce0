"""Fixtures of the tests on real DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager

import pytest
from rclpy.context import Context
from rclpy.node import Node

from tests.ros.commands import hand_written
from tests.ros.system_bench import Peer


@pytest.fixture(scope="session", autouse=True)
def defaults_of_fast_dds(in_a_domain: Callable[[], AbstractContextManager[int]]) -> None:
    """Have Fast DDS read its profile before a host of this process chooses ours.

    It does so once in a process. With ours, of two participants in one process, as only tests have
    them, one may never notice that an endpoint of the other is gone: whether a test would see it
    depended on which one made the first participant.
    """
    with in_a_domain():
        context = Context()
        context.init([])
        Node("first", context=context, start_parameter_services=False).destroy_node()
        context.try_shutdown()


@pytest.fixture
def peer() -> Iterator[Peer]:
    """A hand-written node in a participant of its own."""
    node = Peer()
    try:
        yield node
    finally:
        node.close()


@pytest.fixture(scope="module")
def talker(shared_domain_id: int) -> Iterator[None]:
    """The node ``/lab/talker``, hand-written, in a process of its own."""
    with hand_written("hand_written_talker.py"):
        yield
