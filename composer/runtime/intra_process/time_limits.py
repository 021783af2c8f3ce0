"""Deadlines and leases of topics within the process, in virtual time.

In real time the middleware monitors them, and topics that have one use DDS. As in DDS, a period
begins with a message: nothing is late before the first one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from composer.model.qos import Liveliness, QosProfile
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.tasks import Cancellable
from composer.runtime.intra_process.publisher import FanOut, Target

#: A message at the very end of a period is in time, whatever the rounding of both.
_TOLERANCE_S = 1e-6


class Receiver(Target, Protocol):
    """The receiving side of a subscription."""

    def close(self) -> None:
        """Receive nothing more."""


#: Called with the time of the last message, by the clock of the loop.
OnOverdue = Callable[[float], None]


class Overdue(Target):
    """Calls ``on_overdue`` when a period has passed without a message.

    With ``repeats``, also for each further period, as a deadline; otherwise not again before the
    next message, as a lease.
    """

    __slots__ = ("_call", "_last_s", "_loop", "_on_overdue", "_period_s", "_repeats")

    def __init__(
        self, loop: BaseLoop, period_ms: float, on_overdue: OnOverdue, *, repeats: bool
    ) -> None:
        self._loop = loop
        self._period_s = period_ms / 1000.0
        self._on_overdue = on_overdue
        self._repeats = repeats
        self._last_s = 0.0
        self._call: Cancellable | None = None

    def put(self, _message: Any) -> None:
        """Begin the period again."""
        self._last_s = self._loop.clock.monotonic()
        if self._call is None:
            self._schedule()

    def close(self) -> None:
        """Call back no more, until the next message."""
        if self._call is not None:
            self._call.cancel()
            self._call = None

    def _schedule(self) -> None:
        left_s = self._last_s + self._period_s + _TOLERANCE_S - self._loop.clock.monotonic()
        self._call = self._loop.call_later(left_s, self._check)

    def _check(self) -> None:
        self._call = None
        since_s = self._last_s
        is_overdue = self._loop.clock.monotonic() - since_s > self._period_s
        if is_overdue and self._repeats:
            self._last_s = since_s + self._period_s
        if self._repeats or not is_overdue:
            self._schedule()
        if is_overdue:
            self._on_overdue(since_s)


class MonitoredReceiver(Overdue):
    """Passes messages to the receiver of a subscription, and monitors its deadline."""

    __slots__ = ("_receiver",)

    def __init__(
        self, loop: BaseLoop, deadline_ms: float, on_overdue: OnOverdue, receiver: Receiver
    ) -> None:
        super().__init__(loop, deadline_ms, on_overdue, repeats=True)
        self._receiver = receiver

    def put(self, message: Any) -> None:
        """Begin the period again, and pass the message on."""
        super().put(message)
        self._receiver.put(message)

    def close(self) -> None:
        """Receive nothing more."""
        super().close()
        self._receiver.close()


class Leases:
    """Monitors the liveliness of the publishers of one subscription."""

    def __init__(self, loop: BaseLoop, lease_ms: float, on_overdue: OnOverdue) -> None:
        self._loop = loop
        self._lease_ms = lease_ms
        self._on_overdue = on_overdue
        self._leases: dict[object, Overdue] = {}  # by the publishers

    def target(self, publisher: object, profile: QosProfile, target: Target) -> Target:
        """Return what gets the messages of a publisher with this profile, before ``target``."""
        if profile.liveliness is not Liveliness.MANUAL_BY_TOPIC:
            return target  # the middleware asserts it, as long as the process exists
        if publisher not in self._leases:
            lease = Overdue(self._loop, self._lease_ms, self._on_overdue, repeats=False)
            self._leases[publisher] = lease
        return FanOut((self._leases[publisher], target))

    def forget(self, publisher: object) -> None:
        """Watch the lease of a publisher no more: it is destroyed."""
        lease = self._leases.pop(publisher, None)
        if lease is not None:
            lease.close()

    def close(self) -> None:
        """Call back no more."""
        for lease in self._leases.values():
            lease.close()
