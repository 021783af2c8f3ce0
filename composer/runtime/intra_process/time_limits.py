"""Deadlines and leases of topics within the process, in virtual time.

In real time the middleware monitors them, and topics that have one use DDS. As in DDS, a period
begins with a message: nothing is late before the first one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from composer.model.qos import Liveliness, QosProfile
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.tasks import Cancellable
from composer.runtime.intra_process.publisher import Target, combined

#: A message at the very end of a period is in time, whatever the rounding of both.
_TOLERANCE_S = 1e-6

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


class SubscriptionLimits:
    """The time limits of one subscription, for the messages of each of its publishers."""

    def __init__(
        self,
        loop: BaseLoop,
        profile: QosProfile,
        receiver: Target,
        on_deadline: OnOverdue,
        on_lease: OnOverdue,
    ) -> None:
        self._loop = loop
        self._receiver = receiver
        self._lease_ms = profile.liveliness_lease_duration_ms
        self._on_lease = on_lease
        self._leases: dict[object, Overdue] = {}  # by the publishers
        self._deadline: Overdue | None = None
        if profile.deadline_ms is not None:
            self._deadline = Overdue(loop, profile.deadline_ms, on_deadline, repeats=True)

    def target(self, publisher: object, profile: QosProfile) -> Target:
        """Return what gets the messages of a publisher with this profile."""
        targets: list[Target] = [] if self._deadline is None else [self._deadline]
        # The middleware asserts the other kind of liveliness, as long as the process exists.
        if self._lease_ms is not None and profile.liveliness is Liveliness.MANUAL_BY_TOPIC:
            if publisher not in self._leases:
                lease = Overdue(self._loop, self._lease_ms, self._on_lease, repeats=False)
                self._leases[publisher] = lease
            targets.append(self._leases[publisher])
        return combined((*targets, self._receiver)) or self._receiver

    def forget(self, publisher: object) -> None:
        """Watch the lease of a publisher no more: it is destroyed."""
        lease = self._leases.pop(publisher, None)
        if lease is not None:
            lease.close()

    def close(self) -> None:
        """Call back no more."""
        for limit in filter(None, (self._deadline, *self._leases.values())):
            limit.close()
