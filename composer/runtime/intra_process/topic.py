"""One topic within the process: its local publishers and subscriptions, and the need for DDS.

All that a publisher puts to a subscription goes through the target that
``LocalPublisher._target_of`` returns.

In virtual time, deadlines and leases are monitored here. In real time the middleware monitors them,
and topics that have one use DDS. As in DDS, a period begins with a message: nothing is late before
the first one.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from math import inf
from typing import Any, Protocol

from rclpy.publisher import Publisher

from composer.base.fast_dataclass import dataclass
from composer.model import Isolation, Port
from composer.model.qos import Durability, Liveliness, QosProfile, incompatibilities
from composer.runtime.clock import Clock
from composer.runtime.executors.base_loop import BaseLoop
from composer.runtime.executors.tasks import Cancellable
from composer.runtime.host_options import Target
from composer.runtime.intra_process.dds_flags import MATCHING, MatchListener
from composer.runtime.intra_process.publisher import (
    FanOut,
    GatedPublisher,
    PublisherContext,
    combined,
    copy_of,
)

#: A message at the very end of a period is in time, whatever the rounding of both.
_TOLERANCE_S = 1e-6
#: Called with the time of the last message, by the clock of the loop.
OnOverdue = Callable[[float], None]


class Receiver(Target, Protocol):
    """The receiving side of a subscription."""

    def close(self) -> None:
        """Receive nothing more."""


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


@dataclass(frozen=True, slots=True, eq=False)
class LocalSubscription:
    """A subscription, as publishers of its topic see it.

    ``leases`` has the leases of its publishers, if the runtime monitors them.
    """

    message_type: Any
    port: Port
    receiver: Receiver
    leases: Leases | None


class CopyingTarget:
    """Puts a copy of each message."""

    __slots__ = ("_target",)

    def __init__(self, target: Target) -> None:
        self._target = target

    def put(self, message: Any) -> None:
        """Put a copy of the message."""
        self._target.put(copy_of(message))


class LatchedMessages:
    """Keeps the last messages of a transient-local topic, until their lifespan ends."""

    __slots__ = ("_kept", "_lifespan_s", "_monotonic")

    def __init__(self, profile: QosProfile, clock: Clock) -> None:
        lifespan_ms = profile.lifespan_ms
        self._lifespan_s = inf if lifespan_ms is None else lifespan_ms / 1000.0
        self._monotonic = clock.monotonic
        self._kept: deque[tuple[float, Any]] = deque(maxlen=profile.queue_depth)

    def put(self, message: Any) -> None:
        """Keep the message."""
        self._kept.append((self._monotonic(), message))

    def messages(self) -> list[Any]:
        """Return the messages, the oldest first."""
        since_s = self._monotonic() - self._lifespan_s
        return [message for at_s, message in self._kept if at_s > since_s]

    def take(self) -> Iterator[Any]:
        """Yield the messages, the oldest first, and forget each."""
        since_s = self._monotonic() - self._lifespan_s
        while self._kept:
            at_s, message = self._kept.popleft()
            if at_s > since_s:
                yield message


class LocalPublisher(GatedPublisher):
    """A publisher that also passes each message to the local subscriptions it matches.

    External subscriptions are counted only after a change of matches (``Matching``): the call
    takes half a microsecond, while a whole message takes less than one.
    """

    __slots__ = (
        "_checking",
        "_count_matched",
        "_isolated",
        "_match_listener",
        "_observers",
        "_subscriptions",
        "profile",
    )

    def __init__(self, publisher: Publisher, context: PublisherContext, port: Port) -> None:
        super().__init__(publisher, context)
        self.profile = port.qos.profile
        self._isolated = port.isolation is Isolation.COPY
        self._count_matched: Callable[[], int] = publisher.handle.get_subscription_count
        self._match_listener = MatchListener(publisher, enabled=context.listens_to_matches)
        self._has_external = False
        self._checking = threading.Lock()  # the latest check counts, not the slowest
        self._subscriptions: tuple[LocalSubscription, ...] = ()
        self._observers = context.observers

    def join(self, subscription: LocalSubscription) -> None:
        """Pass messages to ``subscription`` from now on, if it matches."""
        if self._matches(subscription):
            self._set_subscriptions((*self._subscriptions, subscription))

    def leave(self, subscription: LocalSubscription) -> None:
        """Stop passing messages to ``subscription``."""
        self._set_subscriptions(
            tuple(kept for kept in self._subscriptions if kept is not subscription)
        )

    def close(self) -> None:
        """Release the match listener. Call it before the publisher is destroyed."""
        self._match_listener.close()
        for subscription in self._subscriptions:
            if subscription.leases is not None:
                subscription.leases.forget(self)

    def _matches(self, subscription: LocalSubscription) -> bool:
        has_type = subscription.message_type is self.message_type
        return has_type and not incompatibilities(self.profile, subscription.port.qos.profile)

    def _set_subscriptions(self, subscriptions: tuple[LocalSubscription, ...]) -> None:
        self._subscriptions = subscriptions
        self._target = combined((*self._observers, *map(self._target_of, subscriptions)))
        self._check_external()

    def _target_of(self, subscription: LocalSubscription) -> Target:
        target: Target = subscription.receiver
        if subscription.leases is not None:
            target = subscription.leases.target(self, self.profile, target)
        is_isolated = self._isolated or subscription.port.isolation is Isolation.COPY
        return CopyingTarget(target) if is_isolated else target

    def _check_external(self) -> None:
        with self._checking:
            # Before counting: a match that comes in between is seen by the next check.
            is_supported = self._match_listener.is_supported
            self._generation = MATCHING.generation if is_supported else None
            subscriptions = self._subscriptions
            has_external = self._count_matched() > len(subscriptions)
            # A subscription that joins or leaves right now may be in only one of the two numbers.
            # It triggers another check; until then, publish rather than lose a message.
            self._has_external = has_external or subscriptions is not self._subscriptions


class LatchingPublisher(LocalPublisher):
    """A local publisher of a transient-local topic: late joiners get the latched messages."""

    __slots__ = ("_latched", "_lock")

    def __init__(self, publisher: Publisher, context: PublisherContext, port: Port) -> None:
        super().__init__(publisher, context, port)
        self._latched = LatchedMessages(self.profile, context.clock)
        latched = CopyingTarget(self._latched) if self._isolated else self._latched
        self._observers = (*context.observers, latched)
        self._target = combined(self._observers)
        self._has_external = True  # a subscription of another process that joins later needs them
        self._lock = threading.Lock()  # a joining subscription gets each message once

    def publish(self, message: Any) -> None:
        """Publish ``message``, from any thread. Raises TypeError if it has another type.

        It is dropped and counted while the node is not active.
        """
        with self._lock:
            super().publish(message)

    def join(self, subscription: LocalSubscription) -> None:
        """Pass messages to ``subscription`` from now on, if it matches; the latched ones first."""
        if not self._matches(subscription):
            return
        with self._lock:
            if subscription.port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
                for message in self._latched.messages():
                    self._target_of(subscription).put(message)
            self._set_subscriptions((*self._subscriptions, subscription))

    def _check_external(self) -> None:
        """Publish by DDS in any case."""
        self._generation = MATCHING.generation


def local_publisher_for(
    publisher: Publisher, context: PublisherContext, port: Port
) -> LocalPublisher:
    """Return the local publisher of a publisher port."""
    latches = port.qos.profile.durability is Durability.TRANSIENT_LOCAL
    return (LatchingPublisher if latches else LocalPublisher)(publisher, context, port)


class Topic:
    """The local endpoints of one topic."""

    def __init__(self) -> None:
        self._publishers: list[LocalPublisher] = []
        self._subscriptions: list[LocalSubscription] = []
        self._lock = threading.Lock()

    def add_publisher(self, publisher: LocalPublisher) -> None:
        """Connect it to all subscriptions."""
        with self._lock:
            self._publishers.append(publisher)
            for subscription in self._subscriptions:
                publisher.join(subscription)

    def remove_publisher(self, publisher: LocalPublisher) -> None:
        """Disconnect it, and discard what it has latched."""
        with self._lock:
            self._publishers.remove(publisher)
            publisher.close()

    def add_subscription(self, subscription: LocalSubscription) -> None:
        """Connect it to all publishers."""
        with self._lock:
            self._subscriptions.append(subscription)
            for publisher in self._publishers:
                publisher.join(subscription)

    def remove_subscription(self, subscription: LocalSubscription) -> None:
        """Disconnect it and close its receiver."""
        with self._lock:
            self._subscriptions.remove(subscription)
            for publisher in self._publishers:
                publisher.leave(subscription)
        subscription.receiver.close()
