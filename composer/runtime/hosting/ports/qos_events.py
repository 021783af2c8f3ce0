"""The callbacks of QoS events that a class gives its publishers and subscriptions."""

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

from composer.base.fast_dataclass import dataclass
from composer.model import Port, PortKind
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.hosting.user_code import call_in_group
from composer.runtime.intra_process.topic import OnOverdue
from composer.runtime.ports.qos_events import EventKind, QosEvents

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


@dataclass(frozen=True, slots=True)
class OverdueStatus:
    """What callbacks of deadlines and of liveliness get in virtual time, as of rclpy."""

    total_count: int
    total_count_change: int = 1
    alive_count: int = 0
    alive_count_change: int = -1
    not_alive_count: int = 0
    not_alive_count_change: int = 1


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
        if self._is_virtual:
            return []
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

    def _on_overdue(self, event: EventKind) -> OnOverdue:
        if event.kind not in self._callbacks:
            return super()._on_overdue(event)
        count = 0

        def on_overdue(_since_s: float) -> None:
            nonlocal count
            count += 1
            self._call(event.kind, OverdueStatus(count, not_alive_count=count))

        return on_overdue

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
