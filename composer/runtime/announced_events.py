"""QoS events, counted as the middleware announces them.

Nobody takes their status. With rmw_fastrtps of Jazzy a system that did, of missed deadlines of
2 ms, froze in ``take_event`` within two seconds, with the lock of the interpreter held: as far as
seen, who takes and who announces the next one wait for each other. What is announced is a number
(:class:`~composer.runtime.readiness.Signal`), which is all that is needed to count.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation

from composer.runtime.event_loop import EventLoop
from composer.runtime.readiness import EVENT, Signal


class AnnouncedEvents:
    """Those of all publishers and subscriptions of a process. Any thread may call."""

    def __init__(self, loop: EventLoop) -> None:
        """``loop`` is where it is told that something happened, whatever loops nodes have."""
        self._loop = loop

    def watch(
        self, endpoint: Any, kind: IntEnum, happened: Callable[[], None]
    ) -> Callable[[], None]:
        """Call ``happened`` for each event of ``kind``; return what ends that.

        To be ended before ``endpoint``, rclpy's handle of a publisher or a subscription, is
        destroyed. Raises rclpy's UnsupportedEventTypeError.
        """
        slot = self._loop.open_slot(_Announced(endpoint, kind, happened))
        return lambda: self._loop.close_slot(slot)


class _Announced:
    """A source of the loop: what is announced has happened."""

    passes_over = True

    def __init__(self, endpoint: Any, kind: IntEnum, happened: Callable[[], None]) -> None:
        with endpoint:
            self._event = rclpy_implementation.EventHandle(endpoint, kind)
        self._happened = happened
        self._is_first = True
        self.name = kind.name

    def attach(self, signal: Signal) -> None:
        """Have the event announced."""
        signal.attach(self._event, EVENT)

    def detach(self, signal: Signal) -> None:
        """End that, and give it back."""
        signal.detach(self._event)
        self._event.destroy_when_not_in_use()

    def take(self) -> bool | None:
        """Return true for each announcement but the loop's own, which is the first."""
        if self._is_first:
            self._is_first = False
            return None
        return True

    def call(self, _: bool) -> None:
        """Tell."""
        self._happened()
