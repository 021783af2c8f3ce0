"""A byte that the middleware zeroes when something has changed: looking costs next to nothing.

As with ``readiness``, what rcl calls back may not be Python. Here it is libc's
``bzero``, whose two arguments (an address, a count) travel as those of ``void (*)(const void *
user_data, size_t count)`` do. It zeroes ``count`` bytes, for which there has to be room.
"""

from __future__ import annotations

import ctypes
from typing import Final

from rclpy.event_handler import QoSPublisherEventType, UnsupportedEventTypeError
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.publisher import Publisher

from composer.runtime.executors.readiness import EVENT

_ROOM = 1 << 20  # more than events can come together; Linux gives memory when it is used

#: The first byte is zero when a subscription has matched a publisher of this process, or left it.
MARK: Final = bytearray(_ROOM)

_ADDRESS = ctypes.addressof(ctypes.c_char.from_buffer(MARK))
_ZERO = ctypes.cast(ctypes.CDLL(None).bzero, ctypes.c_void_p)


class Matches:
    """Who has matched whom, in periods that end whenever that changes.

    A publisher that has looked in this ``period`` need not look again. One mark and one period
    serve all of them: they are near, and something of each would have to be fetched from memory
    for each message.
    """

    __slots__ = ("period",)

    def __init__(self) -> None:
        #: An object like no other.
        self.period = object()

    def begin_period(self) -> None:
        """To be called when the mark is zero."""
        # Before the mark, for other threads: they see it at once, and this one may have to wait for
        # the interpreter in between. After it, for a change that came before the mark was made.
        self.period = object()
        MARK[0] = 1
        self.period = object()


MATCHES: Final = Matches()


class MatchEvent:
    """Zeroes the mark whenever a subscription matches the publisher, or leaves it."""

    __slots__ = ("_event", "is_told")

    def __init__(self, publisher: Publisher) -> None:
        #: False where the middleware does not tell.
        self.is_told = False
        try:
            with publisher.handle:
                self._event = rclpy_implementation.EventHandle(
                    publisher.handle, QoSPublisherEventType.RCL_PUBLISHER_MATCHED
                )
        except UnsupportedEventTypeError:
            return
        with self._event:
            self.is_told = EVENT(self._event.pointer, _ZERO, _ADDRESS) == 0

    def close(self) -> None:
        """Leave the mark alone from now on. To be called before the publisher is destroyed."""
        if not self.is_told:
            return
        with self._event:
            EVENT(self._event.pointer, None, 0)
        self._event.destroy_when_not_in_use()
        self.is_told = False
