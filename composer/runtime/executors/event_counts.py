"""QoS events, counted from rcl's callbacks, and the status of those where a count is not enough.

A count needs only the number that a ``Signal`` carries. Taking a status is another matter: with
rmw_fastrtps of Jazzy, ``take_event`` can deadlock while the middleware reports the next event. So
a status is taken only when one is certain to be available, and everything is watched as soon as
the endpoint exists. See docs/decisions/0011-fast-dds.md.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from math import inf
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation

from composer.runtime.executors.loop import Loop
from composer.runtime.executors.readiness import EVENT, Signal, SourceGroup


class EventCounts:
    """The QoS events of all publishers and subscriptions of a process. Any thread may call.

    ``endpoint`` is rclpy's handle of a publisher or a subscription; stop watching before it is
    destroyed. Every method raises rclpy's UnsupportedEventTypeError.
    """

    def __init__(self, loop: Loop) -> None:
        """``loop`` makes the calls, whatever loops the nodes have."""
        self._loop = loop

    def watch(
        self, endpoint: Any, kind: IntEnum, on_event: Callable[[], None]
    ) -> Callable[[], None]:
        """Call ``on_event`` for each event of ``kind``; return a function that stops that."""
        group = self._loop.add_group(_CountSource(endpoint, kind, on_event))
        return lambda: self._loop.remove_group(group)

    def watch_status(
        self, endpoint: Any, kind: IntEnum, on_status: Callable[[Any], None]
    ) -> Callable[[], None]:
        """Call ``on_status`` after events of ``kind``; return a function that stops that.

        One status may cover several events. An event that occurs while the last status is being
        taken is reported with the next one.
        """
        source = _StatusSource(endpoint, kind, on_status)
        group = self._loop.add_group(source)
        self._loop.call_soon(lambda: source.begin(group))
        return lambda: self._loop.remove_group(group)


class _EventSource:
    """One kind of event of an endpoint. A group signals a new source once by itself."""

    may_skip = True

    def __init__(self, endpoint: Any, kind: IntEnum, callback: Callable[..., None]) -> None:
        with endpoint:
            self._event = rclpy_implementation.EventHandle(endpoint, kind)
        self._callback = callback
        self.name = kind.name

    def attach(self, signal: Signal) -> None:
        """Signal the event."""
        signal.attach(self._event, EVENT)

    def detach(self, signal: Signal) -> None:
        """Stop that and release the event."""
        signal.detach(self._event)
        self._event.destroy_when_not_in_use()


class _CountSource(_EventSource):
    """Calls back for each signaled event."""

    def __init__(self, endpoint: Any, kind: IntEnum, on_event: Callable[[], None]) -> None:
        super().__init__(endpoint, kind, on_event)
        self._is_first = True

    def take(self) -> bool | None:
        """Return true for each signal but the first, which is the signal of the group."""
        if self._is_first:
            self._is_first = False
            return None
        return True

    def call(self, _: bool) -> None:
        """Call back."""
        self._callback()


class _StatusSource(_EventSource):
    """Calls back with the status of signaled events.

    ``take`` is called once per signal. Events that were signaled before a status was taken may be
    part of it, and are skipped.
    """

    def __init__(self, endpoint: Any, kind: IntEnum, on_status: Callable[[Any], None]) -> None:
        super().__init__(endpoint, kind, on_status)
        self._to_skip: float = inf  # number of signals to skip; all of them until it begins

    def begin(self, group: SourceGroup) -> None:
        """Take the status of events from now on. Call it on the loop."""
        self._group = group
        self._to_skip = group.due + self._count_uncounted()

    def take(self) -> Any:
        """Return the status, or None for a skipped signal."""
        if self._to_skip:
            self._to_skip -= 1
            return None
        status = self._event.take_event()
        self._to_skip = self._group.due - 1 + self._count_uncounted()
        return status

    def call(self, status: Any) -> None:
        """Call back with the status."""
        self._callback(status)

    def _count_uncounted(self) -> int:
        """Return how many signals the loop has not counted yet."""
        signal = self._group.signal
        count = signal.count()
        if count:
            signal.write(count)
        return count
