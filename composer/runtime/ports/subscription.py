"""The subscription port."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from typing import Any

from composer.model import Port
from composer.qos import Durability
from composer.runtime.core import Core
from composer.runtime.delivery.queue import Queue
from composer.runtime.line import Line
from composer.runtime.messages import interface_class
from composer.runtime.ports.port import callback_group
from composer.runtime.ports.profiles import rclpy_profile
from composer.runtime.reactions import RunningReaction
from composer.runtime.tracing import CallbackTimer


class SubscriptionPort:
    """Hands messages to the port's reaction and handler while the node is active.

    Messages that come at other times are dropped and counted, except on a transient-local topic:
    what is latched there comes once, so the last ones are kept for the activation.
    """

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
        timer = CallbackTimer(core, self._traced, port.budget_ms)
        self._line = Line(
            core,
            core.chains.hearing(port, timer.around(self._work)),
            depth=depth,
            reentrant=port.reentrant,
        )
        self._latched: deque[Any] | None = None
        if port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
            self._latched = deque(maxlen=depth)
        self._subscription = core.node.create_subscription(
            interface_class(port.interface.value),
            port.full_name,
            self.receive,
            rclpy_profile(port.qos.profile),
            callback_group=callback_group(core, port),
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
                self._latched.append(message)
            return
        self._statistics.received += 1
        if self._line.put(message) is not None:
            self._count_drop()

    def activate(self) -> None:
        """Take what was latched meanwhile."""
        while self._latched:
            self.receive(self._latched.popleft())

    def deactivate(self) -> None:
        """Drop what waits."""
        left = self._line.clear()
        if self._latched is None:
            self._statistics.dropped += len(left)
        else:
            self._latched.extend(left)

    def destroy(self) -> None:
        """Leave the topic."""
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
