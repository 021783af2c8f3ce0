"""One topic within the process: who publishes, who listens, and what goes out by DDS as well."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message

from composer.model import Isolation, Port
from composer.qos import Durability, incompatibilities
from composer.runtime.delivery.copying import copy_of
from composer.runtime.delivery.queue import Queue
from composer.runtime.marks import MARKS, MatchMark

Send = Callable[[Any], None]


class Inlet:
    """A subscription, as publishers of its topic see it."""

    __slots__ = ("isolated", "message_type", "profile", "queue")

    def __init__(self, message_type: Any, port: Port, queue: Queue) -> None:
        self.message_type = message_type
        self.profile = port.qos.profile
        self.isolated = port.isolation is Isolation.COPY
        self.queue = queue


class Target(Protocol):
    """Where messages are put."""

    def put(self, message: Any) -> None:
        """Have the message received."""


class Copies:
    """Puts copies into a queue."""

    __slots__ = ("_queue",)

    def __init__(self, queue: Queue) -> None:
        self._queue = queue

    def put(self, message: Any) -> None:
        """Have a copy of the message received."""
        self._queue.put(copy_of(message))


class Outlet:
    """A publisher: hands each message to the inlets it matches, and to DDS where that is needed.

    ``send`` may be called from any thread. Whether somebody outside listens is asked of the
    middleware when something has matched or left, which a byte of ``MARKS`` says: asking takes half
    a microsecond, of a message that takes little more than one.
    """

    __slots__ = (
        "_changed_at",
        "_count_matched",
        "_has_outsiders",
        "_inlets",
        "_isolated",
        "_latched",
        "_lock",
        "_looking",
        "_mark",
        "_publish",
        "_targets",
        "message_type",
        "profile",
        "send",
    )

    def __init__(self, publisher: Publisher, port: Port) -> None:
        profile = port.qos.profile
        self.message_type: Any = publisher.msg_type
        self.profile = profile
        self._isolated = port.isolation is Isolation.COPY
        self._publish: Send = publisher.publish
        self._count_matched: Callable[[], int] = publisher.handle.get_subscription_count
        self._mark = MatchMark(publisher)
        self._changed_at = self._mark.index
        self._has_outsiders = False
        self._looking = threading.Lock()  # the last look is what counts, not the slowest
        self._inlets: tuple[Inlet, ...] = ()
        self._targets: tuple[Target, ...] = ()
        self._latched: deque[Any] | None = None
        self.send: Send = self._send
        if profile.durability is Durability.TRANSIENT_LOCAL:
            self._latched = deque(maxlen=profile.queue_depth)
            self._lock = threading.Lock()  # who joins gets each message once
            self.send = self._send_and_latch

    def join(self, inlet: Inlet) -> None:
        """Hand messages to ``inlet`` from now on, if they match; what is latched first."""
        if inlet.message_type is not self.message_type:
            return
        if incompatibilities(self.profile, inlet.profile):
            return
        if self._latched is None:
            self._reach((*self._inlets, inlet))
            return
        with self._lock:
            if inlet.profile.durability is Durability.TRANSIENT_LOCAL:
                for message in self._latched:
                    self._target(inlet).put(message)
            self._reach((*self._inlets, inlet))

    def leave(self, inlet: Inlet) -> None:
        """Hand it no more."""
        self._reach(tuple(kept for kept in self._inlets if kept is not inlet))

    def close(self) -> None:
        """Send nothing any more. To be called before the publisher is destroyed."""
        self._mark.close()

    def _reach(self, inlets: tuple[Inlet, ...]) -> None:
        self._inlets = inlets
        self._targets = tuple(self._target(inlet) for inlet in inlets)
        self._look_outside()

    def _target(self, inlet: Inlet) -> Target:
        return Copies(inlet.queue) if self._isolated or inlet.isolated else inlet.queue

    def _look_outside(self) -> None:
        with self._looking:
            self._mark.set()  # before the look: who matches in between is seen next time
            self._has_outsiders = self._count_matched() > len(self._inlets)

    def _send(self, message: Any) -> None:
        if message.__class__ is not self.message_type:
            message = self._converted(message)
        for target in self._targets:
            target.put(message)
        if not MARKS[self._changed_at]:
            self._look_outside()
        if self._has_outsiders:
            self._publish(message)

    def _send_and_latch(self, message: Any) -> None:
        message = self._converted(message)
        with self._lock:
            if self._latched is not None:
                self._latched.append(copy_of(message) if self._isolated else message)
            for target in self._targets:
                target.put(message)
            self._publish(message)  # somebody who is not here yet may want it

    def _converted(self, message: Any) -> Any:
        """Return what rclpy would publish. Raises TypeError where it would."""
        if isinstance(message, self.message_type):
            return message
        if isinstance(message, bytes):
            return deserialize_message(message, self.message_type)
        raise TypeError(f"Expected {self.message_type}, got {type(message)}")


class Topic:
    """Everybody of the process who has joined the topic now."""

    def __init__(self) -> None:
        self._outlets: list[Outlet] = []
        self._inlets: list[Inlet] = []
        self._lock = threading.Lock()

    def add_outlet(self, outlet: Outlet) -> None:
        """Have it meet everybody who listens."""
        with self._lock:
            self._outlets.append(outlet)
            for inlet in self._inlets:
                outlet.join(inlet)

    def remove_outlet(self, outlet: Outlet) -> None:
        """Forget it, and what is latched in it."""
        with self._lock:
            self._outlets.remove(outlet)
            outlet.close()

    def add_inlet(self, inlet: Inlet) -> None:
        """Have it meet everybody who publishes."""
        with self._lock:
            self._inlets.append(inlet)
            for outlet in self._outlets:
                outlet.join(inlet)

    def remove_inlet(self, inlet: Inlet) -> None:
        """Have nothing more received."""
        with self._lock:
            self._inlets.remove(inlet)
            for outlet in self._outlets:
                outlet.leave(inlet)
        inlet.queue.close()
