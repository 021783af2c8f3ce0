"""The ports of topics: publishers, and subscriptions with their mailboxes."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator
from typing import Any, cast

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from composer.model import Port
from composer.model.qos import Durability
from composer.runtime.callbacks.callback import mutation_checked
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.observers import RememberingTarget
from composer.runtime.callbacks.reactions import MessageReaction
from composer.runtime.host_options import Target
from composer.runtime.intra_process.publisher import PublisherContext
from composer.runtime.intra_process.topic import LatchedMessages
from composer.runtime.ports import RunningPort
from composer.runtime.ports.mailbox import Mailbox, OverlappingMailbox
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.messages import interface_class


class PublisherPort(RunningPort):
    """Publishes while the node is active; otherwise drops and counts messages, and warns once."""

    __slots__ = (
        "_context",
        "_count",
        "_name",
        "_publisher",
        "_qos_events",
        "_remove",
        "_warned",
        "gated",
    )

    def __init__(self, context: NodeContext, port: Port) -> None:
        self._context = context
        self._name = port.name.value
        self._qos_events = self._make_qos_events(port)
        self._publisher = self._make_publisher(port)
        origin = PublisherContext(
            context.gate,
            context.loop.clock,
            self._drop,
            tuple(self._observers(port)),
            listens_to_matches=not self._qos_events.uses_matches,
        )
        #: The publisher that the node's behavior and reactions use.
        self.gated, self._remove = context.router.add_publisher(port, self._publisher, origin)
        self._count = context.statistics.publisher(self._name)
        self._count.begin(self.gated)
        self._warned = False

    def activate(self) -> None:
        """Warn again at the next message that is dropped."""
        self._warned = False
        self._qos_events.activate()

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._qos_events.close()
        self._remove()
        self._count.end()
        self._destroy_publisher()

    def _make_qos_events(self, port: Port) -> QosEvents:
        return QosEvents(self._context, port)

    def _make_publisher(self, port: Port) -> Publisher:
        return self._context.node.create_publisher(
            interface_class(port.interface.value),
            port.full_name,
            rclpy_profile(port.qos.profile),
            callback_group=self._context.group,
            event_callbacks=cast("PublisherEventCallbacks", self._qos_events),
        )

    def _destroy_publisher(self) -> None:
        self._context.node.destroy_publisher(self._publisher)

    def _observers(self, port: Port) -> Iterator[Target]:
        yield from self._qos_events.publisher_limits()
        yield from self._context.chains.published_by(port)
        if self._context.mutations is not None:
            yield RememberingTarget(self._context.mutations, f"published by '{self._name}'")

    def _drop(self) -> None:
        self._context.statistics.dropped += 1
        if not self._warned:
            self._warned = True
            reason = self._context.gate.refusal
            self._context.log.warn(f"publisher '{self._name}' drops its messages: {reason}")


class SubscriptionPort(RunningPort):
    """Passes messages to the port's reaction and handler while the node is active.

    Other messages are dropped and counted, except on a transient-local topic: a latched message
    arrives only once, so the last ones are kept until the activation, or until their lifespan ends.
    """

    __slots__ = (
        "_callback",
        "_context",
        "_count",
        "_handler",
        "_hops",
        "_latched",
        "_mailbox",
        "_name",
        "_qos_events",
        "_reaction",
        "_remove",
        "_statistics",
        "_subscription",
    )

    def __init__(
        self,
        context: NodeContext,
        port: Port,
        reaction: MessageReaction | None,
        handler: Callable[[Any], Any] | None,
    ) -> None:
        self._context = context
        self._name = port.name.value
        self._callback = f"on_{self._name}"
        self._reaction = reaction
        self._handler = handler
        self._statistics = context.statistics.callback(port.kind.value, self._name)
        self._hops = context.chains.received_by(port)
        handle: Callable[[Any], Any] = mutation_checked(
            context.mutations, self._statistics, self._handle
        )
        if handler and not (reaction or context.mutations or self._hops):
            handle = handler  # without a frame in between
        mailbox_type = OverlappingMailbox if port.reentrant else Mailbox
        self._mailbox = mailbox_type(context, port, handle, self._statistics, self)
        self._count = context.statistics.subscription(self._name)
        self._count.begin(self._mailbox)
        self._latched: LatchedMessages | None = None
        if port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
            self._latched = LatchedMessages(port.qos.profile, context.loop.clock)
        self._qos_events = self._make_qos_events(port)
        self._subscription = self._make_subscription(port)
        self._remove = self._receive(port)

    def activate(self) -> None:
        """Handle the messages that were latched meanwhile."""
        self._mailbox.restart()
        self._qos_events.activate()
        for message in () if self._latched is None else self._latched.take():
            self._mailbox.put(message)

    def deactivate(self) -> None:
        """Drop or latch the messages that wait."""
        self._mailbox.clear()

    def hold(self, message: Any) -> None:
        """Keep or drop a message that arrives while the node is not active."""
        if self._latched is None:
            self._context.statistics.dropped += 1
        else:
            self._latched.put(message)

    def count_drop(self) -> None:
        """Count a message that was dropped from the full queue."""
        self._context.statistics.dropped += 1
        self._statistics.dropped += 1

    def destroy(self) -> None:
        """Destroy the subscription."""
        self._qos_events.close()
        self._remove()
        self._count.end()
        self._context.loop.remove(self._subscription)
        self._destroy_subscription()

    def _make_qos_events(self, port: Port) -> QosEvents:
        return QosEvents(self._context, port)

    def _make_subscription(self, port: Port) -> Subscription:
        return self._context.node.create_subscription(
            interface_class(port.interface.value),
            port.full_name,
            self._mailbox.receive,
            rclpy_profile(port.qos.profile),
            callback_group=self._context.group_of(port),
            event_callbacks=cast("SubscriptionEventCallbacks", self._qos_events),
        )

    def _receive(self, port: Port) -> Callable[[], None]:
        """Receive messages from now on; return a function that stops local ones."""
        context = self._context
        receiver, leases = self._qos_events.monitored(self._mailbox)
        remove = context.router.add_subscription(port, self._subscription, receiver, leases)
        context.loop.add_subscription(self._subscription, self._mailbox.receive)
        return remove

    def _destroy_subscription(self) -> None:
        self._context.node.destroy_subscription(self._subscription)

    def _handle(self, message: Any) -> Coroutine[Any, Any, None] | None:
        for hop in self._hops:
            hop.on_received(message)
        if self._context.mutations is not None:
            self._context.mutations.remember(message, f"received by '{self._name}'")
        if self._reaction is not None:
            try:
                self._reaction.run(message=message)
            except Exception as error:
                self._context.error_log.exception(f"subscription '{self._name}'", error)
        if self._handler is None:
            return None
        return self._context.call(self._callback, self._handler, message)
