"""QoS events, counted as the middleware announces them, and their status where that tells more.

What is announced is a number (``Signal``), which is all that is
needed to count. To take a status is another matter. With rmw_fastrtps of Jazzy a system that took
those of missed deadlines of 2 ms froze in ``take_event`` within two seconds, with the lock of the
interpreter held: rmw keeps the status that it has announced, and hands that out under a lock of its
own; with that lock held it asks the reader where there is none, whose lock is held by who announces
the next one and waits for rmw's. So a status is taken only where one is there for certain.

To begin to watch is no better: rmw asks for the status with its lock held. It is safe as long as
nothing else that is watched happens to the endpoint in that instant. So all of it is watched as
soon as the endpoint is made, first what happens rarely, last what may happen all the time.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from math import inf
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation

from composer.runtime.executors.event_loop import EventLoop
from composer.runtime.executors.readiness import EVENT, Signal
from composer.runtime.executors.source_group import Slot


class AnnouncedEvents:
    """Those of all publishers and subscriptions of a process. Any thread may call.

    What is watched is to be ended before ``endpoint``, rclpy's handle of a publisher or a
    subscription, is destroyed. All raise rclpy's UnsupportedEventTypeError.
    """

    def __init__(self, loop: EventLoop) -> None:
        """``loop`` is where it is told that something happened, whatever loops nodes have."""
        self._loop = loop

    def watch(
        self, endpoint: Any, kind: IntEnum, happened: Callable[[], None]
    ) -> Callable[[], None]:
        """Call ``happened`` for each event of ``kind``; return what ends that."""
        slot = self._loop.open_slot(_Announced(endpoint, kind, happened))
        return lambda: self._loop.close_slot(slot)

    def watch_status(
        self, endpoint: Any, kind: IntEnum, happened: Callable[[Any], None]
    ) -> Callable[[], None]:
        """Call ``happened`` with the status after events of ``kind``; return what ends that.

        One status may be that of several events. One that comes in the instant in which the last
        status is taken is told with the next.
        """
        source = _Status(endpoint, kind, happened)
        slot = self._loop.open_slot(source)
        self._loop.call_soon(lambda: source.begin(slot))
        return lambda: self._loop.close_slot(slot)


class _Event:
    """An event of an endpoint, which the loop has announced once when it begins to serve it."""

    passes_over = True

    def __init__(self, endpoint: Any, kind: IntEnum, happened: Callable[..., None]) -> None:
        with endpoint:
            self._event = rclpy_implementation.EventHandle(endpoint, kind)
        self._happened = happened
        self.name = kind.name

    def attach(self, signal: Signal) -> None:
        """Have the event announced."""
        signal.attach(self._event, EVENT)

    def detach(self, signal: Signal) -> None:
        """End that, and give it back."""
        signal.detach(self._event)
        self._event.destroy_when_not_in_use()


class _Announced(_Event):
    """A source of the loop: what is announced has happened."""

    def __init__(self, endpoint: Any, kind: IntEnum, happened: Callable[[], None]) -> None:
        super().__init__(endpoint, kind, happened)
        self._is_first = True

    def take(self) -> bool | None:
        """Return true for each announcement but the loop's own, which is the first."""
        if self._is_first:
            self._is_first = False
            return None
        return True

    def call(self, _: bool) -> None:
        """Tell."""
        self._happened()


class _Status(_Event):
    """A source of the loop: the status of what is announced.

    ``take`` is called once for each announcement. Whatever was announced until a status had been
    taken may be part of it, and is passed over.
    """

    def __init__(self, endpoint: Any, kind: IntEnum, happened: Callable[[Any], None]) -> None:
        super().__init__(endpoint, kind, happened)
        self._passed_over: float = inf  # so many announcements to come; until it has begun, all

    def begin(self, slot: Slot) -> None:
        """Take the status of what is announced from now on. To be called on the loop."""
        self._slot = slot
        self._passed_over = slot.due + self._waiting()

    def take(self) -> Any:
        """Return the status, or None for what is passed over."""
        if self._passed_over:
            self._passed_over -= 1
            return None
        status = self._event.take_event()
        self._passed_over = self._slot.due - 1 + self._waiting()
        return status

    def call(self, status: Any) -> None:
        """Tell."""
        self._happened(status)

    def _waiting(self) -> int:
        """Return how many announcements the loop has not counted yet."""
        signal = self._slot.signal
        waiting = signal.count()
        if waiting:
            signal.announce(waiting)
        return waiting
