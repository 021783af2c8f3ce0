"""How much memory connections take, in one place.

Everything that is kept for a connection is counted in bytes: updates and replies that wait to be
sent, messages that wait to be published, requests that run, and the names and parameters of its
subscriptions. So all of them together take at most ``MAX_CONNECTIONS * CONNECTION_BYTES``. In
addition, each has a message that is being received (``MAX_MESSAGE``) and one that is being sent.
"""

from __future__ import annotations

import threading

from composer.dashboard.protocol.errors import RequestError

#: Browsers and programs that are connected at the same time.
MAX_CONNECTIONS = 32
#: What is kept for one of them, in bytes.
CONNECTION_BYTES = 16 * 1024 * 1024
#: The largest message of a browser or program, in bytes.
MAX_MESSAGE = 1024 * 1024


class Budget:
    """The bytes that are kept for one connection. Thread-safe."""

    def __init__(self, limit: int = CONNECTION_BYTES) -> None:
        self._limit = limit
        self._lock = threading.Lock()
        self._used = 0

    @property
    def used(self) -> int:
        """The number of bytes that are kept."""
        return self._used

    def has(self, size: int) -> bool:
        """Return whether so many more bytes may be kept."""
        return self._used + size <= self._limit

    def take(self, size: int) -> None:
        """Count bytes that are kept from now on. Raises RequestError if they are too many."""
        with self._lock:
            if not self.has(size):
                limit = f"{self._limit // 1024**2} MB"
                raise RequestError("too_many", f"{limit} are the limit for all that waits for you")
            self._used += size

    def give(self, size: int) -> None:
        """Count bytes that are not kept any more."""
        with self._lock:
            self._used -= size
