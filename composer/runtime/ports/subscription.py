"""The subscription port."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from math import inf
from time import monotonic
from typing import Any, cast

from rclpy.event_handler import SubscriptionEventCallbacks

from composer.model import Port
from composer.qos import Durability
from composer.runtime.core import Core
from composer.runtime.delivery.queue import Queue
from composer.runtime.line import line_for
from composer.runtime.messages import interface_class
from composer.runtime.ports.port import callback_group
from composer.runtime.ports.profiles import rclpy_profile
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.reactions import RunningReaction
from composer.runtime.strand import Work
from composer.runtime.tracing import CallbackTimer


class SubscriptionPort:
    """Hands messages to the port's reaction and handler while the node is active.

    Messages that come at other times are dropped and counted, except on a transient-local topic:
    what is latched there comes once, so the last ones are kept for the activation, or for as long
    as their lifespan is.
    """

    __slots__ = (
        "_callback",
        "_core",
        "_gate",
        "_handler",
        "_latched",
        "_leave",
        "_lifespan_s",
        "_line",
        "_name",
        "_qos_events",
        "_reaction",
        "_statistics",
        "_subscription",
        "_traced",
    )

    def __init__(
        self,
        core: Core,
        port: Port,
        reaction: RunningReaction | None,
        handler: Callable[[Any], Any] | None,
    ) -> None:
        self._core = core
        self._gate = core.gate
        self._statistics = core.statistics
        self._name = port.name.value
        self._callback = f"on_{self._name}"
        self._reaction = reaction
        self._handler = handler
        depth = port.qos.profile.queue_depth
        self._traced = core.statistics.callback(port.kind.value, self._name)
        work: Work[Any] = self._work
        if handler is not None and reaction is None and core.mutations is None:
            work = core.caller(self._callback, handler)  # which is shorter
        self._line = line_for(
            core,
            core.chains.hearing(port, work),
            CallbackTimer(core, self._traced, port.budget_ms),
            depth=depth,
            reentrant=port.reentrant,
        )
        self._latched: deque[tuple[float, Any]] | None = None  # each with when it came
        lifespan_ms = port.qos.profile.lifespan_ms
        self._lifespan_s = inf if lifespan_ms is None else lifespan_ms / 1000.0
        if port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
            self._latched = deque(maxlen=depth)
        self._qos_events = QosEvents(core, port)
        self._subscription = core.node.create_subscription(
            interface_class(port.interface.value),
            port.full_name,
            self.receive,
            rclpy_profile(port.qos.profile),
            callback_group=callback_group(core, port),
            event_callbacks=cast(SubscriptionEventCallbacks, self._qos_events),
        )
        queue = Queue(core.loop.call_soon, self.receive, depth, self._count_drop)
        self._leave = core.delivery.add_subscription(port, self._subscription, queue)
        core.loop.add_subscription(self._subscription, self.receive)

    def receive(self, message: Any) -> None:
        """Take a message that has come."""
        if not self._gate.incoming:
            if self._latched is None:
                self._statistics.dropped += 1
            else:
                self._latched.append((monotonic(), message))
            return
        self._statistics.received += 1
        if self._line.put(message) is not None:
            self._count_drop()

    def activate(self) -> None:
        """Take what was latched meanwhile."""
        since_s = monotonic() - self._lifespan_s
        while self._latched:
            came_s, message = self._latched.popleft()
            if came_s >= since_s:
                self.receive(message)

    def deactivate(self) -> None:
        """Drop what waits."""
        left = self._line.clear()
        if self._latched is None:
            self._statistics.dropped += len(left)
        else:
            self._latched.extend((monotonic(), message) for message in left)

    def destroy(self) -> None:
        """Leave the topic."""
        self._qos_events.close()
        self._leave()
        self._core.loop.remove(self._subscription)
        self._core.node.destroy_subscription(self._subscription)

    def _count_drop(self) -> None:
        self._statistics.dropped += 1
        self._traced.dropped += 1

    def _work(self, message: Any) -> Coroutine[Any, Any, None] | None:
        if self._core.mutations is not None:
            self._core.mutations.remember(message, f"received by '{self._name}'")
        if self._reaction is not None:
            try:
                self._reaction.run(message=message)
            except Exception as error:
                self._core.faults.take(f"subscription '{self._name}'", error)
        if self._handler is None:
            return None
        return self._core.call(self._callback, self._handler, message)
