"""How rcl signals that an entity has something to take.

rcl calls back on the middleware's threads, which hold the reader's lock. A Python callback there
needs the interpreter's lock, while rclpy's ``take`` holds that lock and waits for the reader's:
a deadlock, observed within a second under load. So the callback handed to rcl is libc's
``eventfd_write``, whose two arguments (a file descriptor, a count) have the calling convention of
``void (*)(const void * user_data, size_t count)`` on x86-64 and arm64. No Python runs there.

All knowledge of rcl's and rclpy's internals (rclpy 7.1, ROS 2 Jazzy) is here, in ``sources`` and in
``actions``.

A loop serves sources, in groups that share one eventfd.
"""

from __future__ import annotations

import ctypes
import os
import resource
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import rclpy  # noqa: F401  loads librcl of the ROS installation in use


class Handle(Protocol):
    """An rclpy handle (``_rclpy.Destroyable``), which owns an rcl entity."""

    @property
    def pointer(self) -> int:
        """The address of the rcl entity."""

    def __enter__(self) -> None:
        """Postpone the destruction of the entity."""

    def __exit__(self, *_: object) -> None:
        """Destroy the entity if that was postponed."""


#: A function of rcl that sets the callback of one kind of entity.
SetCallback = Callable[[int, ctypes.c_void_p | None, int], int]

_RCL = ctypes.CDLL("librcl.so")
_RCL_ACTION = ctypes.CDLL("librcl_action.so")
_WRITE = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p)
#: More items than can be waiting: take until nothing is left.
_ALL = 1 << 32


def _set_callback(library: ctypes.CDLL, name: str) -> SetCallback:
    function = getattr(library, name)
    function.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    function.restype = ctypes.c_int
    return function  # type: ignore[no-any-return]


MESSAGE = _set_callback(_RCL, "rcl_subscription_set_on_new_message_callback")
REQUEST = _set_callback(_RCL, "rcl_service_set_on_new_request_callback")
RESPONSE = _set_callback(_RCL, "rcl_client_set_on_new_response_callback")
EVENT = _set_callback(_RCL, "rcl_event_set_callback")
ACTION_SERVER = tuple(
    _set_callback(_RCL_ACTION, f"rcl_action_server_set_{kind}_service_callback")
    for kind in ("goal", "cancel", "result")
)
ACTION_CLIENT = tuple(
    _set_callback(_RCL_ACTION, f"rcl_action_client_set_{kind}_callback")
    for kind in (
        "goal_client",
        "cancel_client",
        "result_client",
        "feedback_subscription",
    )
)


class Signal:
    """An eventfd that rcl writes when an attached entity has something to take.

    An attached entity is in use, so its destruction is postponed: rcl never writes to a file
    descriptor that was reused.
    """

    def __init__(self) -> None:
        self.fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        _raise_file_limit(self.fd)
        #: Returns the number of items signaled since the last read; raises BlockingIOError if
        #: there are none. A partial, not a method: called per message.
        self.read: Callable[[], int] = partial(os.eventfd_read, self.fd)
        self._attached: list[tuple[Handle, tuple[SetCallback, ...]]] = []

    def attach(self, handle: Handle, *setters: SetCallback) -> None:
        """Make rcl write the eventfd for the entity.

        Raises rclpy's InvalidHandle if the entity is destroyed, RuntimeError if rcl refuses.
        """
        handle.__enter__()
        self._attached.append((handle, setters))
        for set_callback in setters:
            if set_callback(handle.pointer, _WRITE, self.fd) != 0:
                self.detach(handle)
                raise RuntimeError(f"rcl cannot set a callback of {handle!r}")

    def detach(self, handle: Handle) -> None:
        """Stop that, and let the entity be destroyed."""
        for attached in [item for item in self._attached if item[0] is handle]:
            self._attached.remove(attached)
            for set_callback in attached[1]:
                set_callback(handle.pointer, None, 0)
            handle.__exit__(None, None, None)

    def write(self, number: int) -> None:
        """Signal ``number`` items, as rcl does."""
        os.eventfd_write(self.fd, number)

    def count(self) -> int:
        """Return the number of items signaled since the last read."""
        try:
            return self.read()
        except BlockingIOError:
            return 0

    def close(self) -> None:
        """Detach everything."""
        for handle, _ in list(self._attached):
            self.detach(handle)

    def __del__(self) -> None:
        # Not earlier: a thread about to read must not read a file descriptor that was reused.
        os.close(self.fd)


class EntitySource(ABC):
    """One entity that a loop serves: one item at a time, so that a loop can serve them in turn.

    ``may_skip`` is true if a take may return nothing although more items follow. A client receives
    all responses of its service and skips those to other clients. ``take()`` returns the next item,
    or None, and ``call(item)`` passes it to its callback.
    """

    __slots__ = ("_handle", "_setters")

    may_skip: bool
    take: Callable[[], Any]
    call: Callable[[Any], object]

    @property
    @abstractmethod
    def name(self) -> str:
        """A description of the entity, for reports."""

    def __init__(self, handle: Handle, *setters: SetCallback) -> None:
        self._handle = handle
        self._setters = setters

    def attach(self, signal: Signal) -> None:
        """Make ``signal`` signal the items of the entity."""
        signal.attach(self._handle, *self._setters)

    def detach(self, signal: Signal) -> None:
        """Stop that."""
        signal.detach(self._handle)


class SourceGroup:
    """Sources that share one signal. The loop serves them together, one item each."""

    __slots__ = ("_may_skip", "due", "signal", "sources")

    def __init__(self) -> None:
        self.signal = Signal()
        self.sources: tuple[EntitySource, ...] = ()
        self.due = 0  # items that were signaled and not taken yet
        self._may_skip = True

    def add(self, source: EntitySource) -> None:
        """Serve ``source`` from now on. Raises InvalidHandle if its entity is destroyed."""
        self.sources = (*self.sources, source)
        self._may_skip = self._may_skip and source.may_skip
        try:
            source.attach(self.signal)
        except BaseException:
            self.discard(source)
            raise
        # Items from before may have been signaled to another group.
        self.signal.write(1 if self._may_skip else _ALL)

    def finish_round(self, taken: int) -> None:
        """Update ``due`` after a round of takes; ``taken`` is how many of them returned an item."""
        if taken < self.due and (taken or self._may_skip):
            self.due -= taken or 1
        else:
            self.due = 0  # nothing taken: a full queue has dropped what was signaled

    def discard(self, source: EntitySource) -> None:
        """Stop serving ``source``."""
        self.sources = tuple(kept for kept in self.sources if kept is not source)
        source.detach(self.signal)

    def close(self) -> None:
        """Stop serving all sources."""
        self.sources = ()
        self.signal.close()


def _raise_file_limit(fd: int) -> None:
    """Raise the limit of open files if half of it is in use: a large system needs thousands.

    Linux uses the lowest free descriptor, so ``fd`` shows how many are open.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if fd > soft // 2 and soft < hard:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 2 * soft), hard))
