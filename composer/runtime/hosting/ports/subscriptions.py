"""Subscriptions that a class creates."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription

from composer.model import Port, PortKind
from composer.runtime.executors.sources import Taken
from composer.runtime.hosting.instance import Instance, is_reentrant
from composer.runtime.hosting.ports.qos_events import HostedQosEvents, PendingQosEvents
from composer.runtime.hosting.user_code import UserFunction
from composer.runtime.ports.mailbox import Mailbox
from composer.runtime.ports.qos_events import QosEvents
from composer.runtime.ports.subscription import SubscriptionPort


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
        return context.router.add_subscription(port, subscription, _WithInfo(mailbox))

    def _destroy_subscription(self) -> None:
        Node.destroy_subscription(self._instance.node, self._given)


class _WithInfo:
    """Adds to messages from this process the information that rclpy has of others."""

    __slots__ = ("_mailbox",)

    def __init__(self, mailbox: Mailbox) -> None:
        self._mailbox = mailbox

    def put(self, message: Any) -> None:
        """Put the message with its information, from any thread."""
        now_ns = time.time_ns()
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
