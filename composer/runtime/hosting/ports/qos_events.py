"""QoS events of endpoints that a class creates, with the event callbacks of the class."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
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

from composer.model import Port, PortKind
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.hosting.user_code import call_in_group
from composer.runtime.ports.qos_events import QosEvents

_PUBLISHER = QoSPublisherEventType
_SUBSCRIPTION = QoSSubscriptionEventType
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


class HostedQosEvents(QosEvents):
    """Counts and logs the events of an endpoint, except those that have a callback of the class.

    Those are passed to the callback. Each is called while the node is active.
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

    def create_event_handlers(
        self, callback_group: CallbackGroup, endpoint: Any, topic_name: str
    ) -> list[EventHandler]:
        """Watch the events; those with a callback first, as far as lost messages come last."""
        lost = _SUBSCRIPTION.RCL_SUBSCRIPTION_MESSAGE_LOST
        for kind, callback in self._callbacks.items():
            if kind is not lost:
                self._watch_for_class(endpoint, kind, callback)
        super().create_event_handlers(callback_group, endpoint, topic_name)
        if lost in self._callbacks:
            self._watch_for_class(endpoint, lost, self._callbacks[lost])
        return []

    def _watch_incompatible(self, endpoint: Any, kind: IntEnum) -> None:
        if kind not in self._callbacks:
            super()._watch_incompatible(endpoint, kind)

    def _watch(self, endpoint: Any, event: Any) -> None:
        if event.kind not in self._callbacks:
            super()._watch(endpoint, event)

    def _watch_for_class(
        self, endpoint: Any, kind: IntEnum, callback: Callable[[Any], Any]
    ) -> None:
        call_soon = self._context.loop.call_soon

        def on_status(status: Any) -> None:
            call_soon(partial(call_in_group, self._context, callback, status))

        with suppress(UnsupportedEventTypeError):
            self._stop_watching.append(self._context.events.watch_status(endpoint, kind, on_status))
