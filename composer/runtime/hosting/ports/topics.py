"""Publishers and subscriptions that a class creates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rclpy.lifecycle.publisher import LifecyclePublisher
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import serialize_message
from rclpy.subscription import Subscription

from composer.model import Port, PortKind
from composer.model.qos import Durability
from composer.runtime.clock import Clock
from composer.runtime.executors.futures import Future
from composer.runtime.executors.sources import Taken
from composer.runtime.hosting.declared_ports import OF_EVERY_NODE
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.ports.qos_events import HostedQosEvents, PendingQosEvents
from composer.runtime.intra_process.publisher import copy_of
from composer.runtime.intra_process.topic import LatchedMessages
from composer.runtime.ports.mailbox import Mailbox
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ports.topics import PublisherPort, SubscriptionPort


class HostedPublisher(PublisherPort):
    """A publisher port around rclpy's publisher, which the class uses.

    Messages that are published while the node is not active are dropped. Those of a transient-local
    topic are kept and sent on activation: a class may publish one in its constructor, once.
    """

    def __init__(self, instance: Instance, publisher: Publisher, events: PendingQosEvents) -> None:
        port = instance.ports.port(
            PortKind.PUBLISHER, publisher.topic_name, publisher.msg_type, publisher.qos_profile
        )
        self._instance = instance
        self.port = port
        self._given = publisher
        context = instance.context_of(port, publisher)
        self._callbacks = {
            kind: instance.function(callback, publisher, context)
            for kind, callback in events.callbacks(PortKind.PUBLISHER).items()
        }
        self._held = LatchedMessages(port.qos.profile, context.loop.clock)
        super().__init__(context, port)
        # An attribute of the object hides the method of the class at no cost per call.
        publisher.publish = self._publish_function()  # type: ignore[method-assign, assignment]

    def activate(self) -> None:
        """Send the messages that were kept."""
        super().activate()
        for message in self._held.take():
            self.gated.publish(message)

    def _publish_function(self) -> Callable[[Any], None]:
        publish = self.gated.publish
        if self.port.qos.profile.durability is Durability.TRANSIENT_LOCAL:
            publish = self._publish_or_keep
        publisher = self._given
        if not isinstance(publisher, LifecyclePublisher):
            return publish

        def publish_if_enabled(message: Any) -> None:
            if publisher.is_activated:
                publish(message)

        return publish_if_enabled

    def _publish_or_keep(self, message: Any) -> None:
        if self._context.gate.outgoing:
            self.gated.publish(message)
        else:
            self._held.put(message if isinstance(message, bytes) else copy_of(message))

    def _make_qos_events(self, port: Port) -> QosEvents:
        return HostedQosEvents(self._context, port, self._callbacks)

    def _make_publisher(self, _port: Port) -> Publisher:
        publisher = self._given
        self._qos_events.create_event_handlers(self._context.group, publisher.handle, "")
        return publisher

    def _destroy_publisher(self) -> None:
        Node.destroy_publisher(self._instance.node, self._given)


class HostedSubscription(SubscriptionPort):
    """A subscription port around rclpy's subscription, with the callback of the class."""

    def __init__(
        self, instance: Instance, subscription: Subscription, events: PendingQosEvents
    ) -> None:
        port = instance.ports.port(
            PortKind.SUBSCRIPTION,
            subscription.topic_name,
            subscription.msg_type,
            subscription.qos_profile,
        )
        self._instance = instance
        self.port = port
        self._given = subscription
        context = instance.context_of(port, subscription)
        self._callbacks = {
            kind: instance.function(callback, subscription, context)
            for kind, callback in events.callbacks(PortKind.SUBSCRIPTION).items()
        }
        # rclpy's type hints make this a method: it is the callback that the class has given.
        callback: Any = subscription.callback
        self._with_info = subscription._callback_type is Subscription.CallbackType.WithMessageInfo
        function = instance.function(callback, subscription, context)
        handler = (lambda pair: function(*pair)) if self._with_info else function
        if is_reentrant(context):
            port = replace(port, reentrant=True)
        super().__init__(context, port, None, handler)

    def _make_qos_events(self, port: Port) -> QosEvents:
        return HostedQosEvents(self._context, port, self._callbacks)

    def _make_subscription(self, _port: Port) -> Subscription:
        subscription = self._given
        self._qos_events.create_event_handlers(self._context.group, subscription.handle, "")
        return subscription

    def _receive(self, port: Port) -> Callable[[], None]:
        context, mailbox, subscription = self._context, self._mailbox, self._subscription
        is_virtual = context.loop.clock.is_virtual
        if is_virtual and port.full_name in OF_EVERY_NODE:
            context.log.warn(
                f"subscription on {port.full_name} receives nothing in virtual time,"
                " because the middleware publishes it"
            )
        if not (self._with_info or subscription.raw):
            return super()._receive(port)

        def receive(taken: Taken) -> None:
            mailbox.receive((taken, None) if self._with_info else taken)

        context.loop.add_subscription(subscription, receive)
        if subscription.raw and not is_virtual:  # only the middleware has the bytes
            return mailbox.close
        receiver, leases = self._qos_events.monitored(
            _Adapted(mailbox, context.loop.clock, subscription.raw, self._with_info)
        )
        return context.router.add_subscription(port, subscription, receiver, leases)

    def _destroy_subscription(self) -> None:
        Node.destroy_subscription(self._instance.node, self._given)


class _Adapted:
    """Passes messages from this process as rclpy does: serialized, or with their information."""

    __slots__ = ("_clock", "_is_raw", "_mailbox", "_with_info")

    def __init__(self, mailbox: Mailbox, clock: Clock, is_raw: bool, with_info: bool) -> None:
        self._mailbox = mailbox
        self._clock = clock
        self._is_raw = is_raw
        self._with_info = with_info

    def put(self, message: Any) -> None:
        """Put the message, from any thread."""
        content = serialize_message(message) if self._is_raw else message
        if not self._with_info:
            self._mailbox.put(content)
            return
        now_ns = self._clock.time_ns()
        info = {
            "source_timestamp": now_ns,
            "received_timestamp": now_ns,
            "publication_sequence_number": None,
            "reception_sequence_number": None,
        }
        self._mailbox.put((content, info))

    def close(self) -> None:
        """Receive nothing more."""
        self._mailbox.close()


class FirstMessage(Future[Any]):
    """The first message that a subscription receives."""

    def put(self, message: Any) -> None:
        """Receive a message, from any thread."""
        self.set_result(message)

    def close(self) -> None:
        """Do nothing: later messages do not count."""
