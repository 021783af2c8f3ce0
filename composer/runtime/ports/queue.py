"""The messages that wait at a subscription."""

from __future__ import annotations

from collections import deque
from typing import Any, Protocol

#: From here on a list is slow to give its first away: it moves all others.
_DEEP = 256


class Queue(Protocol):
    """Messages, the oldest first. Each method is atomic, whichever threads call."""

    def append(self, message: Any, /) -> None:
        """Put ``message`` behind all others."""

    def pop(self, first: int, /) -> Any:
        """Take a message, of which ``first`` is to be 0. Raises IndexError when there is none."""

    def clear(self) -> None:
        """Let go of all of them."""

    def __len__(self) -> int:
        """How many there are."""


class _DeepQueue(deque[Any]):
    """A deque that gives its first away as a list does."""

    def pop(self, _first: int = 0, /) -> Any:
        """Take the oldest."""
        return self.popleft()


def queue_of(depth: float) -> Queue:
    """Return a queue that will hold up to about ``depth`` messages.

    Of a few a list is made. It is a single object in memory as long as it is empty, a deque has a
    block for 64 messages somewhere else, which in a large system has to be fetched for each.
    """
    return [] if depth < _DEEP else _DeepQueue()
