"""How rcl says that an entity has something to take.

rcl calls back on the middleware's threads, which hold the reader's lock. A Python callback there
needs the interpreter's lock, while rclpy's ``take`` holds that one and waits for the reader's:
a deadlock, met within a second under load. So the callback handed to rcl is libc's own
``eventfd_write``, whose two arguments (a file descriptor, a count) travel in the registers of
``void (*)(const void * user_data, size_t count)`` on x86-64 and arm64. No Python runs there.

This module and ``entity_sources`` hold all that is known of rcl's and rclpy's
insides (rclpy 7.1, ROS 2 Jazzy).
"""

from __future__ import annotations

import ctypes
import os
import resource
from collections.abc import Callable
from functools import partial
from typing import Protocol

import rclpy  # noqa: F401  loads librcl, whichever ROS it is of


class Handle(Protocol):
    """An rclpy handle (``_rclpy.Destroyable``): what owns an rcl entity."""

    @property
    def pointer(self) -> int:
        """The address of the rcl entity."""

    def __enter__(self) -> None:
        """Put off the destruction of the entity."""

    def __exit__(self, *_: object) -> None:
        """Destroy the entity when that was put off."""


#: Sets the callback of one kind of entity: rcl's function.
Announcement = Callable[[int, ctypes.c_void_p | None, int], int]

_RCL = ctypes.CDLL("librcl.so")
_RCL_ACTION = ctypes.CDLL("librcl_action.so")
_WRITE = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p)


def _announcement(library: ctypes.CDLL, name: str) -> Announcement:
    function = getattr(library, name)
    function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    function.restype = ctypes.c_int
    return function  # type: ignore[no-any-return]


MESSAGE = _announcement(_RCL, "rcl_subscription_set_on_new_message_callback")
REQUEST = _announcement(_RCL, "rcl_service_set_on_new_request_callback")
RESPONSE = _announcement(_RCL, "rcl_client_set_on_new_response_callback")
EVENT = _announcement(_RCL, "rcl_event_set_callback")
ACTION_SERVER = tuple(
    _announcement(_RCL_ACTION, f"rcl_action_server_set_{kind}_service_callback")
    for kind in ("goal", "cancel", "result")
)
ACTION_CLIENT = tuple(
    _announcement(_RCL_ACTION, f"rcl_action_client_set_{kind}_callback")
    for kind in (
        "goal_client",
        "cancel_client",
        "result_client",
        "feedback_subscription",
        "status_subscription",
    )
)


class Signal:
    """An eventfd that rcl writes when one of the entities attached has something to take.

    While attached an entity is in use, so destroying it early only puts the destruction off:
    rcl never writes to a file descriptor that belongs to somebody else by now.
    """

    def __init__(self) -> None:
        self.fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        _leave_room_above(self.fd)
        #: Returns how many things were announced since the last time; raises BlockingIOError for
        #: none. Not a method: this is called for each message.
        self.read: Callable[[], int] = partial(os.eventfd_read, self.fd)
        self._attached: list[tuple[Handle, tuple[Announcement, ...]]] = []

    def attach(self, handle: Handle, *announcements: Announcement) -> None:
        """Have rcl announce the entity.

        Raises rclpy's InvalidHandle when the entity is destroyed, RuntimeError when rcl refuses.
        """
        handle.__enter__()
        self._attached.append((handle, announcements))
        for announce in announcements:
            if announce(handle.pointer, _WRITE, self.fd) != 0:
                self.detach(handle)
                raise RuntimeError(f"rcl does not announce {handle!r}")

    def detach(self, handle: Handle) -> None:
        """Have rcl announce the entity no more, and let it be destroyed."""
        for attached in [item for item in self._attached if item[0] is handle]:
            self._attached.remove(attached)
            for announce in attached[1]:
                announce(handle.pointer, None, 0)
            handle.__exit__(None, None, None)

    def announce(self, number: int) -> None:
        """Announce so many things, as rcl does."""
        os.eventfd_write(self.fd, number)

    def count(self) -> int:
        """Return how many things were announced since the last time."""
        try:
            return self.read()
        except BlockingIOError:
            return 0

    def close(self) -> None:
        """Detach everything."""
        for handle, _ in list(self._attached):
            self.detach(handle)

    def __del__(self) -> None:
        # Not sooner: who is about to read must not read what is somebody else's by now.
        os.close(self.fd)


def _leave_room_above(fd: int) -> None:
    """Raise the limit of open files when half of it is used: a large system needs thousands.

    Linux gives out the lowest free descriptor, so ``fd`` tells how many there are.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if fd > soft // 2 and soft < hard:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 2 * soft), hard))
