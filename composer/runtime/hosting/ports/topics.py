"""Publishers and subscriptions that a class creates, with its callbacks of QoS events."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from enum import IntEnum
from functools import partial
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import (
    EventHandler,
    QoSPublisherEventType,
    QoSSubscriptionEventType,
    UnsupportedEventTypeError,
)
from rclpy.lifecycle.publisher import LifecyclePublisher
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from composer.base.fast_dataclass import dataclass
from composer.model import Port, PortKind
from composer.model.qos import Durability
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.clock.clock import Clock
from composer.runtime.executors.sources import Taken
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.user_code import UserFunction, call_in_group
from composer.runtime.intra_process.publisher import copy_of
from composer.runtime.ports.mailbox import Mailbox
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ports.topics import PublisherPort, SubscriptionPort

_PUBLISHER = QoSPublisherEventType
_SUBSCRIPTION = QoSSubscriptionEventType
#: Returns the number of matches of an endpoint, by the kind of event.
_COUNTS: Mapping[IntEnum, Callable[[Any], int]] = {
    _PUBLISHER.RCL_PUBLISHER_MATCHED: lambda endpoint: int(endpoint.get_subscription_count()),
    _SUBSCRIPTION.RCL_SUBSCRIPTION_MATCHED: lambda endpoint: int(endpoint.get_publisher_count()),
}
#: The kinds of events by the attributes of rclpy's event callbacks.
_KINDS: Mapping[PortKind, Mapping[str, IntEnum]] = {
    PortKind.PUBLISHER: {
        "matched": _PUBLISHER.RCL_PUBLISHER_MATCHED,
        "deadline": _PUBLISHER.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
        "liveliness": _PUBLISHER.RCL_PUBLISHER_LIVELINESS_LOST,
        "incompatible_qos": _PUBLISHER.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        "incompatible_type": _PUBLISHER.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
    },
    PortKind.SUBSCRIPTION: {
        "matched": _SUBSCRIPTION.RCL_SUBSCRIPTION_MATCHED,
        "deadline": _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,
        "liveliness": _SUBSCRIPTION.RCL_SUBSCRIPTION_LIVELINESS_CHANGED,
        "incompatible_qos": _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        "incompatible_type": _SUBSCRIPTION.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
        "message_lost": _SUBSCRIPTION.RCL_SUBSCRIPTION_MESSAGE_LOST,
    },
}


class PendingQosEvents:
    """The event callbacks that a class gives an endpoint, until the endpoint has a port.

    It takes the place of rclpy's event callbacks, and creates no event handlers.
    """

    def __init__(self, given: Any) -> None:
        self.given = given

    def create_event_handlers(
        self, _callback_group: CallbackGroup, _endpoint: Any, _topic_name: str
    ) -> list[EventHandler]:
        """Create none."""
        return []

    def callbacks(self, kind: PortKind) -> dict[IntEnum, Callable[[Any], Any]]:
        """Return the callbacks of the class by the kind of event."""
        found = {event: getattr(self.given, name, None) for name, event in _KINDS[kind].items()}
        return {event: callback for event, callback in found.items() if callback is not None}


@dataclass(frozen=True, slots=True)
class MatchedStatus:
    """What a callback of matches gets, as of rclpy, whose own type cannot be constructed."""

    total_count: int = 0
    total_count_change: int = 0
    current_count: int = 0
    current_count_change: int = 0


class HostedQosEvents(QosEvents):
    """Counts and logs the events of an endpoint, except those that have a callback of the class.

    Those are passed to the callback. Each is called while the node is active. At the activation,
    the callback of matches is called if their number has changed: under rclpy, a class gets earlier
    matches as soon as it is spun.
    """

    def __init__(
        self,
        context: NodeContext,
        port: Port,
        callbacks: Mapping[IntEnum, Callable[[Any], Any]],
    ) -> None:
        super().__init__(context, port)
        self._callbacks = dict(callbacks)
        self.uses_matches = _PUBLISHER.RCL_PUBLISHER_MATCHED in callbacks
        self._endpoint: Any = None
        self._matches = MatchedStatus()

    def activate(self) -> None:
        """Call back from now on."""
        super().activate()
        matched = next((kind for kind in self._callbacks if kind in _COUNTS), None)
        if matched is None:
            return
        count = _COUNTS[matched](self._endpoint)
        change = count - self._matches.current_count
        if change:
            added = max(change, 0)
            self._call(
                matched, MatchedStatus(self._matches.total_count + added, added, count, change)
            )

    def create_event_handlers(
        self, callback_group: CallbackGroup, endpoint: Any, topic_name: str
    ) -> list[EventHandler]:
        """Watch the events; those with a callback first, as far as lost messages come last."""
        self._endpoint = endpoint
        lost = _SUBSCRIPTION.RCL_SUBSCRIPTION_MESSAGE_LOST
        for kind in self._callbacks:
            if kind is not lost:
                self._watch_for_class(endpoint, kind)
        super().create_event_handlers(callback_group, endpoint, topic_name)
        if lost in self._callbacks:
            self._watch_for_class(endpoint, lost)
        return []

    def _watch_incompatible(self, endpoint: Any, kind: IntEnum) -> None:
        if kind not in self._callbacks:
            super()._watch_incompatible(endpoint, kind)

    def _watch(self, endpoint: Any, event: Any) -> None:
        if event.kind not in self._callbacks:
            super()._watch(endpoint, event)

    def _watch_for_class(self, endpoint: Any, kind: IntEnum) -> None:
        on_status = partial(self._call, kind)
        with suppress(UnsupportedEventTypeError):
            self._stop_watching.append(self._context.events.watch_status(endpoint, kind, on_status))

    def _call(self, kind: IntEnum, status: Any) -> None:
        """Call the callback of the class soon, if the node is active then."""
        self._context.loop.call_soon(partial(self._call_now, kind, status))

    def _call_now(self, kind: IntEnum, status: Any) -> None:
        if kind in _COUNTS and self._context.gate.incoming:
            last, self._matches = self._matches, status
            counts = status.total_count, status.current_count
            if counts == (last.total_count, last.current_count):
                return  # the event was on its way while the activation has reported it
        call_in_group(self._context, self._callbacks[kind], status)


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
        self._callbacks = {
            kind: UserFunction(instance, callback)
            for kind, callback in events.callbacks(PortKind.PUBLISHER).items()
        }
        self._held: deque[Any] = deque(maxlen=port.qos.profile.queue_depth)
        super().__init__(instance.context_of(port, publisher), port)
        # An attribute of the object hides the method of the class at no cost per call.
        publisher.publish = self._publish_function()  # type: ignore[method-assign, assignment]

    def activate(self) -> None:
        """Send the messages that were kept."""
        super().activate()
        while self._held:
            self.gated.publish(self._held.popleft())

    def destroy(self) -> None:
        """Destroy the publisher."""
        self._instance.ports.forget(self.port)
        super().destroy()

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
            self._held.append(message if isinstance(message, bytes) else copy_of(message))

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
        self._callbacks = {
            kind: UserFunction(instance, callback)
            for kind, callback in events.callbacks(PortKind.SUBSCRIPTION).items()
        }
        # rclpy's type hints make this a method: it is the callback that the class has given.
        callback: Any = subscription.callback
        self._with_info = subscription._callback_type is Subscription.CallbackType.WithMessageInfo
        function = UserFunction(instance, callback)
        handler = (lambda pair: function(*pair)) if self._with_info else function
        context = instance.context_of(port, subscription)
        if is_reentrant(context):
            port = replace(port, reentrant=True)
        super().__init__(context, port, None, handler)

    def destroy(self) -> None:
        """Destroy the subscription."""
        self._instance.ports.forget(self.port)
        super().destroy()

    def _make_qos_events(self, port: Port) -> QosEvents:
        return HostedQosEvents(self._context, port, self._callbacks)

    def _make_subscription(self, _port: Port) -> Subscription:
        subscription = self._given
        self._qos_events.create_event_handlers(self._context.group, subscription.handle, "")
        return subscription

    def _receive(self, port: Port) -> Callable[[], None]:
        context, mailbox, subscription = self._context, self._mailbox, self._subscription
        if not (self._with_info or subscription.raw):
            return super()._receive(port)

        def receive(taken: Taken) -> None:
            mailbox.receive((taken, None) if self._with_info else taken)

        context.loop.add_subscription(subscription, receive)
        if subscription.raw:  # only the middleware has the bytes
            return mailbox.close
        return context.router.add_subscription(
            port, subscription, _WithInfo(mailbox, context.loop.clock)
        )

    def _destroy_subscription(self) -> None:
        Node.destroy_subscription(self._instance.node, self._given)


class _WithInfo:
    """Adds to messages from this process the information that rclpy has of others."""

    __slots__ = ("_clock", "_mailbox")

    def __init__(self, mailbox: Mailbox, clock: Clock) -> None:
        self._clock = clock
        self._mailbox = mailbox

    def put(self, message: Any) -> None:
        """Put the message with its information, from any thread."""
        now_ns = self._clock.time_ns()
        info = {
            "source_timestamp": now_ns,
            "received_timestamp": now_ns,
            "publication_sequence_number": None,
            "reception_sequence_number": None,
        }
        self._mailbox.put((message, info))

    def close(self) -> None:
        """Receive nothing more."""
        self._mailbox.close()
