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
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import RunningReaction
from composer.runtime.callbacks.timing import watched
from composer.runtime.ports.mailbox import Mailbox, OverlappingMailbox
from composer.runtime.ports.port import callback_group
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ros.messages import interface_class
from composer.runtime.ros.qos_profiles import rclpy_profile


class SubscriptionPort:
    """Hands messages to the port's reaction and handler while the node is active.

    Messages that come at other times are dropped and counted, except on a transient-local topic:
    what is latched there comes once, so the last ones are kept for the activation, or for as long
    as their lifespan is.
    """

    __slots__ = (
        "_callback",
        "_core",
        "_handler",
        "_hops",
        "_latched",
        "_leave",
        "_lifespan_s",
        "_mailbox",
        "_name",
        "_qos_events",
        "_reaction",
        "_subscription",
        "_tally",
        "_traced",
    )

    def __init__(
        self,
        core: NodeContext,
        port: Port,
        reaction: RunningReaction | None,
        handler: Callable[[Any], Any] | None,
    ) -> None:
        self._core = core
        self._name = port.name.value
        self._callback = f"on_{self._name}"
        self._reaction = reaction
        self._handler = handler
        depth = port.qos.profile.queue_depth
        self._traced = core.statistics.callback(port.kind.value, self._name)
        self._hops = core.chains.hearing(port)
        handle: Callable[[Any], Any] = watched(core.mutations, self._traced, self._handle)
        if handler and not (reaction or core.mutations or self._hops):
            handle = handler  # which is shorter
        kind = OverlappingMailbox if port.reentrant else Mailbox
        self._mailbox = kind(core, port, handle, self._traced, self)
        self._tally = core.statistics.subscription(self._name)
        self._tally.begin(self._mailbox)
        self._latched: deque[tuple[float, Any]] | None = None  # each with when it came
        lifespan_ms = port.qos.profile.lifespan_ms
        self._lifespan_s = inf if lifespan_ms is None else lifespan_ms / 1000.0
        if port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
            self._latched = deque(maxlen=depth)
        self._qos_events = QosEvents(core, port)
        self._subscription = core.node.create_subscription(
            interface_class(port.interface.value),
            port.full_name,
            self._mailbox.receive,
            rclpy_profile(port.qos.profile),
            callback_group=callback_group(core, port),
            event_callbacks=cast(SubscriptionEventCallbacks, self._qos_events),
        )
        self._leave = core.delivery.add_subscription(port, self._subscription, self._mailbox)
        core.loop.add_subscription(self._subscription, self._mailbox.receive)

    def activate(self) -> None:
        """Take what was latched meanwhile."""
        self._mailbox.begin_anew()
        since_s = monotonic() - self._lifespan_s
        while self._latched:
            came_s, message = self._latched.popleft()
            if came_s >= since_s:
                self._mailbox.put(message)

    def deactivate(self) -> None:
        """Let go of what waits."""
        self._mailbox.clear()

    def hold(self, message: Any) -> None:
        """Keep or drop a message that comes while the node is not active."""
        if self._latched is None:
            self._core.statistics.dropped += 1
        else:
            self._latched.append((monotonic(), message))

    def count_drop(self) -> None:
        """Count a message that made room for the next."""
        self._core.statistics.dropped += 1
        self._traced.dropped += 1

    def destroy(self) -> None:
        """Leave the topic."""
        self._qos_events.close()
        self._leave()
        self._tally.end()
        self._core.loop.remove(self._subscription)
        self._core.node.destroy_subscription(self._subscription)

    def _handle(self, message: Any) -> Coroutine[Any, Any, None] | None:
        for hop in self._hops:
            hop.hear(message)
        if self._core.mutations is not None:
            self._core.mutations.remember(message, f"received by '{self._name}'")
        if self._reaction is not None:
            try:
                self._reaction.run(message=message)
            except Exception as error:
                self._core.error_log.exception(f"subscription '{self._name}'", error)
        if self._handler is None:
            return None
        return self._core.call(self._callback, self._handler, message)
