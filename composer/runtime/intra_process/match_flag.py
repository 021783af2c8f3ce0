"""A byte that the middleware zeroes when a match changes, so that publishers can poll it.

As in ``readiness``, rcl must not call Python on the middleware's threads. The callback handed to
rcl is libc's ``bzero``, whose two arguments (an address, a count) have the calling convention of
``void (*)(const void * user_data, size_t count)``. It zeroes ``count`` bytes, so the buffer has
room for as many events as can be reported together.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Final, TypeVar

from rclpy.event_handler import QoSPublisherEventType, UnsupportedEventTypeError
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.publisher import Publisher

from composer.runtime.executors.readiness import EVENT

T = TypeVar("T")

_SIZE = 1 << 20  # more events than can be reported together; Linux commits pages on first use

#: The first byte is zero once a subscription has matched or unmatched a publisher of this process.
MATCH_FLAG: Final = bytearray(_SIZE)

_ADDRESS = ctypes.addressof(ctypes.c_char.from_buffer(MATCH_FLAG))
_ZERO = ctypes.cast(ctypes.CDLL(None).bzero, ctypes.c_void_p)


class Matching:
    """The current generation of matches, which is replaced whenever a match changes.

    A publisher that has counted its matches in this ``generation`` need not count again. One flag
    and one generation serve all publishers: they stay in the cache, while an object per publisher
    would be fetched from memory for each message.
    """

    __slots__ = ("generation", "is_supported")

    def __init__(self) -> None:
        #: A unique object.
        self.generation = object()
        #: False if a match does not zero the flag here: then they are counted for each message.
        self.is_supported = True

    def begin_generation(self) -> None:
        """Begin a generation. Call it when the flag is zero."""
        # Replaced before the flag is set, so that other threads see the change even if this one
        # loses the interpreter's lock in between; and after, for a change in that moment.
        self.generation = object()
        MATCH_FLAG[0] = 1
        self.generation = object()


MATCHING: Final = Matching()


class MatchListener:
    """Zeroes the flag whenever a subscription matches or unmatches the publisher."""

    __slots__ = ("_event", "is_supported")

    def __init__(self, publisher: Publisher, *, enabled: bool = True) -> None:
        """Listen unless it is not ``enabled``: rmw has one callback per kind of event."""
        #: False if matches are not reported.
        self.is_supported = False
        if not (enabled and MATCHING.is_supported):
            return
        try:
            with publisher.handle:
                self._event = rclpy_implementation.EventHandle(
                    publisher.handle, QoSPublisherEventType.RCL_PUBLISHER_MATCHED
                )
        except UnsupportedEventTypeError:
            return
        with self._event:
            self.is_supported = EVENT(self._event.pointer, _ZERO, _ADDRESS) == 0

    def close(self) -> None:
        """Stop zeroing the flag. Call it before the publisher is destroyed."""
        if not self.is_supported:
            return
        with self._event:
            EVENT(self._event.pointer, None, 0)
        self._event.destroy_when_not_in_use()
        self.is_supported = False


def checked_match(publisher: Publisher, match: Callable[[], T]) -> T:
    """Return ``match()``, which matches a publisher, and check that it zeroes the flag."""
    MATCHING.is_supported = True
    listener = MatchListener(publisher)
    MATCHING.begin_generation()
    matched = match()
    MATCHING.is_supported = listener.is_supported and not MATCH_FLAG[0]
    listener.close()
    return matched
