"""One topic within the process: who publishes, who listens, and what goes out by DDS as well."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from rclpy.publisher import Publisher

from composer.model import Isolation, Port
from composer.qos import Durability, incompatibilities
from composer.runtime.intra_process.copying import copy_of
from composer.runtime.intra_process.match_flag import MATCHES, MatchEvent
from composer.runtime.intra_process.publisher import Origin, Sender, Target, as_one


class Receiver(Target, Protocol):
    """What a subscription gets its messages by."""

    def close(self) -> None:
        """Take nothing more."""


class LocalSubscription:
    """A subscription, as publishers of its topic see it."""

    __slots__ = ("isolated", "message_type", "profile", "receiver")

    def __init__(self, message_type: Any, port: Port, receiver: Receiver) -> None:
        self.message_type = message_type
        self.profile = port.qos.profile
        self.isolated = port.isolation is Isolation.COPY
        self.receiver = receiver


class Copies:
    """Puts copies."""

    __slots__ = ("_receiver",)

    def __init__(self, receiver: Receiver) -> None:
        self._receiver = receiver

    def put(self, message: Any) -> None:
        """Have a copy of the message received."""
        self._receiver.put(copy_of(message))


class Latched:
    """Keeps what was sent last; of messages that nobody is to share, copies."""

    __slots__ = ("_isolated", "messages")

    def __init__(self, depth: int | None, *, isolated: bool) -> None:
        self._isolated = isolated
        self.messages: deque[Any] = deque(maxlen=depth)

    def put(self, message: Any) -> None:
        """Keep the message."""
        self.messages.append(copy_of(message) if self._isolated else message)


class LocalPublisher(Sender):
    """A publisher that hands each message to the inlets it matches as well.

    Whether somebody outside listens is asked of the middleware when something has matched or left
    (``Matches``): asking takes half a microsecond, of a message that
    takes less than one.
    """

    __slots__ = (
        "_count_matched",
        "_inlets",
        "_isolated",
        "_looking",
        "_match_event",
        "_watchers",
        "profile",
    )

    def __init__(self, publisher: Publisher, origin: Origin, port: Port) -> None:
        super().__init__(publisher, origin)
        self.profile = port.qos.profile
        self._isolated = port.isolation is Isolation.COPY
        self._count_matched: Callable[[], int] = publisher.handle.get_subscription_count
        self._match_event = MatchEvent(publisher)
        self._has_outsiders = False
        self._looking = threading.Lock()  # the last look is what counts, not the slowest
        self._inlets: tuple[LocalSubscription, ...] = ()
        self._watchers = origin.watchers

    def join(self, inlet: LocalSubscription) -> None:
        """Hand messages to ``inlet`` from now on, if they match."""
        if self._matches(inlet):
            self._reach((*self._inlets, inlet))

    def leave(self, inlet: LocalSubscription) -> None:
        """Hand it no more."""
        self._reach(tuple(kept for kept in self._inlets if kept is not inlet))

    def close(self) -> None:
        """Send nothing any more. To be called before the publisher is destroyed."""
        self._match_event.close()

    def _matches(self, inlet: LocalSubscription) -> bool:
        is_of_the_type = inlet.message_type is self.message_type
        return is_of_the_type and not incompatibilities(self.profile, inlet.profile)

    def _reach(self, inlets: tuple[LocalSubscription, ...]) -> None:
        self._inlets = inlets
        self._target = as_one((*self._watchers, *map(self._target_of, inlets)))
        self._look_outside()

    def _target_of(self, inlet: LocalSubscription) -> Target:
        return Copies(inlet.receiver) if self._isolated or inlet.isolated else inlet.receiver

    def _look_outside(self) -> None:
        with self._looking:
            # Before the look: who matches in between is seen next time.
            self._period = MATCHES.period if self._match_event.is_told else None
            inlets = self._inlets
            has_others = self._count_matched() > len(inlets)
            # Whoever joins or leaves at this very moment may be counted on one side only; he has it
            # looked again, and until then nobody outside is to miss anything.
            self._has_outsiders = has_others or inlets is not self._inlets


class LatchingOutlet(LocalPublisher):
    """An outlet of a transient-local topic: who joins later gets what was sent before."""

    __slots__ = ("_latched", "_lock")

    def __init__(self, publisher: Publisher, origin: Origin, port: Port) -> None:
        super().__init__(publisher, origin, port)
        self._latched = Latched(self.profile.queue_depth, isolated=self._isolated)
        self._watchers = (*origin.watchers, self._latched)
        self._target = as_one(self._watchers)
        self._has_outsiders = True  # somebody who is not here yet may want what is sent
        self._lock = threading.Lock()  # who joins gets each message once

    def publish(self, message: Any) -> None:
        """Send ``message``, from any thread. Raises TypeError when it is not of the topic's type.

        It is dropped and counted while the node is not active.
        """
        with self._lock:
            super().publish(message)

    def join(self, inlet: LocalSubscription) -> None:
        """Hand messages to ``inlet`` from now on, if they match; what is latched first."""
        if not self._matches(inlet):
            return
        with self._lock:
            if inlet.profile.durability is Durability.TRANSIENT_LOCAL:
                for message in self._latched.messages:
                    self._target_of(inlet).put(message)
            self._reach((*self._inlets, inlet))

    def _look_outside(self) -> None:
        """Send to DDS whoever is there."""
        self._period = MATCHES.period


def outlet_for(publisher: Publisher, origin: Origin, port: Port) -> LocalPublisher:
    """Return the outlet of a publisher port."""
    latches = port.qos.profile.durability is Durability.TRANSIENT_LOCAL
    return (LatchingOutlet if latches else LocalPublisher)(publisher, origin, port)


class Topic:
    """Everybody of the process who has joined the topic now."""

    def __init__(self) -> None:
        self._outlets: list[LocalPublisher] = []
        self._inlets: list[LocalSubscription] = []
        self._lock = threading.Lock()

    def add_outlet(self, outlet: LocalPublisher) -> None:
        """Have it meet everybody who listens."""
        with self._lock:
            self._outlets.append(outlet)
            for inlet in self._inlets:
                outlet.join(inlet)

    def remove_outlet(self, outlet: LocalPublisher) -> None:
        """Forget it, and what is latched in it."""
        with self._lock:
            self._outlets.remove(outlet)
            outlet.close()

    def add_inlet(self, inlet: LocalSubscription) -> None:
        """Have it meet everybody who publishes."""
        with self._lock:
            self._inlets.append(inlet)
            for outlet in self._outlets:
                outlet.join(inlet)

    def remove_inlet(self, inlet: LocalSubscription) -> None:
        """Have nothing more received."""
        with self._lock:
            self._inlets.remove(inlet)
            for outlet in self._outlets:
                outlet.leave(inlet)
        inlet.receiver.close()
