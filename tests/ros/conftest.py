"""Fixtures of the tests on real DDS."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.ros.support.commands import hand_written
from tests.ros.support.in_process import Peer


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
