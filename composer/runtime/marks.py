"""Bytes that the middleware zeroes when something has changed: looking costs next to nothing.

As with :mod:`composer.runtime.readiness`, what rcl calls back may not be Python. Here it is libc's
``bzero``, whose two arguments (an address, a count) travel as those of ``void (*)(const void *
user_data, size_t count)`` do. It zeroes ``count`` bytes; that those behind are zeroed with it only
means that somebody looks once more than needed.
"""

from __future__ import annotations

import ctypes

from rclpy.event_handler import QoSPublisherEventType, UnsupportedEventTypeError
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.publisher import Publisher

from composer.runtime.readiness import EVENT

_MARKS = 1 << 14  # more publishers than a process can start; a place is an int of Python
_ROOM_BEHIND = 1 << 20  # more than events can come together; Linux gives memory when it is used

#: The bytes of all marks of the process.
MARKS = bytearray(_MARKS + _ROOM_BEHIND)

_ADDRESS = ctypes.addressof(ctypes.c_char.from_buffer(MARKS))
_ZERO = ctypes.cast(ctypes.CDLL(None).bzero, ctypes.c_void_p)
#: The byte at 0 is for those who have none of their own: always zero.
_NONE = 0
#: The byte that is never zero, of those who need not look: no mark is before it.
STEADY = 1
MARKS[STEADY] = 1
_free = list(range(_MARKS - 1, STEADY, -1))


class MatchMark:
    """A byte that becomes zero whenever a subscription matches the publisher, or leaves it.

    Where the middleware does not tell, or there are too many publishers, it is zero at any time.
    """

    __slots__ = ("_event", "index")

    def __init__(self, publisher: Publisher) -> None:
        self.index = _NONE
        try:
            with publisher.handle:
                self._event = rclpy_implementation.EventHandle(
                    publisher.handle, QoSPublisherEventType.RCL_PUBLISHER_MATCHED
                )
        except UnsupportedEventTypeError:
            return
        try:
            index = _free.pop()
        except IndexError:
            return
        with self._event:
            if EVENT(self._event.pointer, _ZERO, _ADDRESS + index) == 0:
                self.index = index
            else:
                _free.append(index)

    def set(self) -> None:
        """Make the byte one until something changes."""
        if self.index != _NONE:
            MARKS[self.index] = 1

    def close(self) -> None:
        """Leave the byte alone from now on. To be called before the publisher is destroyed."""
        if self.index == _NONE:
            return
        with self._event:
            EVENT(self._event.pointer, None, 0)
        self._event.destroy_when_not_in_use()
        MARKS[self.index] = 0
        _free.append(self.index)
        self.index = _NONE
