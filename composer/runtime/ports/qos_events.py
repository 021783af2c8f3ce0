"""QoS events of a publisher or a subscription: counted, and logged with the names of nodes.

rclpy logs incompatible QoS with its own logger and does not name the other node.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from enum import IntEnum
from functools import partial
from math import inf
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
from composer.model.qos import Liveliness, incompatibilities
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.host_options import Target
from composer.runtime.intra_process.topic import (
    Leases,
    MonitoredReceiver,
    OnOverdue,
    Overdue,
    Receiver,
)
from composer.runtime.metrics.repeat_limit import RepeatLimit
from composer.runtime.ros.endpoints import EndpointInfo, topic_info

_CHECK_PERIOD_S = 0.1
_CHECKS = 20
_MAX_REPORTED = 100  # other nodes can be started without end
#: Minimum time between two warnings about the same event.
WARNING_PERIOD_S = 10.0
_DEADLINE_MISSED = "deadline_missed"
_LIVELINESS_LOST = "liveliness_lost"
_LIVELINESS_CHANGED = "liveliness_changed"
_PUBLISHER = QoSPublisherEventType
_SUBSCRIPTION = QoSSubscriptionEventType
#: Events about endpoints that do not match, which occur when they are discovered.
_INCOMPATIBLE = {
    PortKind.PUBLISHER: (
        _PUBLISHER.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        _PUBLISHER.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
    ),
    PortKind.SUBSCRIPTION: (
        _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        _SUBSCRIPTION.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
    ),
}


class IncompatibleQos:
    """Warns once of each node whose endpoint does not match a port."""

    def __init__(self, context: NodeContext, port: Port) -> None:
        self._context = context
        self._port = port
        self._reported: set[str] = set()
        self._checks_left = 0
        self._closed = False

    def check(self) -> None:
        """Check now, and again until the middleware knows the endpoint and its node."""
        is_checking = self._checks_left > 0
        self._checks_left = _CHECKS
        if not is_checking:
            self._check()

    def close(self) -> None:
        """Stop checking."""
        self._closed = True

    def _check(self) -> None:
        if self._closed:
            return
        self._checks_left -= 1
        others = self._incompatible()
        if self._checks_left and (not others or any(other.is_nameless for other in others)):
            self._context.loop.call_later(_CHECK_PERIOD_S, self._check)
            return
        self._checks_left = 0
        for text in (text for other in others for text in self._reasons(other)):
            if text not in self._reported and len(self._reported) < _MAX_REPORTED:
                self._reported.add(text)
                self._context.log.warn(f"{self._port.kind} '{self._port.name}' {text}")

    def _incompatible(self) -> tuple[EndpointInfo, ...]:
        info = topic_info(self._context.node, self._port.full_name, ())
        others = info.subscriptions if self._is_publisher else info.publishers
        return tuple(other for other in others if any(self._reasons(other)))

    @property
    def _is_publisher(self) -> bool:
        return self._port.kind is PortKind.PUBLISHER

    def _reasons(self, other: EndpointInfo) -> Iterator[str]:
        port = self._port
        topic = f"is incompatible with {other.name} on {port.full_name}"
        if other.type != port.interface.value:
            yield f"{topic}: its type is {other.type}, not {port.interface.value}"
            return
        own = port.qos.profile
        profiles = (own, other.qos) if self._is_publisher else (other.qos, own)
        for incompatibility in incompatibilities(*profiles):
            offered, requested = incompatibility.offered, incompatibility.requested
            here, there = (offered, requested) if self._is_publisher else (requested, offered)
            policy, reason = incompatibility.policy, incompatibility.reason
            yield f"{topic}: {policy} is {there} there, {here} here; {reason}"


@dataclass(frozen=True, slots=True)
class EventKind:
    """A kind of event, how it is counted, and what is logged.

    ``count`` returns the number of events from a status. Without it, each signal is one event.
    ``period_s`` is how long the port was silent before an event.
    """

    name: str
    kind: IntEnum
    text: str
    count: Callable[[Any], int] | None = None
    period_s: float = 0.0


class QosEvents:
    """The ``event_callbacks`` of one port, from which rclpy creates event handlers.

    It creates none. Incompatible endpoints, deadlines and the port's own liveliness are counted
    (``EventCounts``). For lost messages and the liveliness of other endpoints the status is taken,
    which has their number and distinguishes a loss from a recovery. Matches are not watched here:
    in-process delivery does (``MatchListener``), and rmw has one callback per kind of event.

    Events are ignored while the node is not active. The middleware does not know lifecycle states:
    it measures a deadline or a lease from the last message, even if that was sent before the node
    was deactivated. So an event also counts only if the node was active for the whole period.

    In virtual time the middleware is not asked: ``intra_process.topic`` has deadlines and leases.
    """

    #: Whether it watches matches, so that in-process delivery cannot.
    uses_matches = False

    def __init__(self, context: NodeContext, port: Port) -> None:
        self._context = context
        self._port = port
        self._incompatible = IncompatibleQos(context, port)
        self._repeats = RepeatLimit(context.loop.clock, WARNING_PERIOD_S)
        self._stop_watching: list[Callable[[], None]] = []
        self._active_since_s = inf  # by the loop's clock
        self._is_virtual = context.loop.clock.is_virtual

    def create_event_handlers(
        self, _callback_group: CallbackGroup, endpoint: Any, _topic_name: str
    ) -> list[EventHandler]:
        """Watch the events that the middleware supports; lost messages last."""
        if self._is_virtual:
            return []
        for kind in _INCOMPATIBLE[self._port.kind]:
            with suppress(UnsupportedEventTypeError):
                self._watch_incompatible(endpoint, kind)
        is_publisher = self._port.kind is PortKind.PUBLISHER
        for event in self._publisher_events() if is_publisher else self._subscription_events():
            with suppress(UnsupportedEventTypeError):
                self._watch(endpoint, event)
        return []

    def activate(self) -> None:
        """Count events from now on; events that take a period, after one period."""
        self._active_since_s = self._context.loop.clock.monotonic()

    def publisher_limits(self) -> tuple[Target, ...]:
        """Return what has to get each message of a publisher: its time limits in virtual time."""
        profile = self._port.qos.profile
        periods = {event.name: event for event in self._publisher_events()}
        if profile.liveliness is Liveliness.AUTOMATIC:  # asserted as long as the process exists
            periods.pop(_LIVELINESS_LOST, None)
        limits = [
            Overdue(
                *(self._context.loop, 1000.0 * event.period_s, self._on_overdue(event)),
                repeats=event.name == _DEADLINE_MISSED,
            )
            for event in periods.values()
            if self._is_virtual
        ]
        self._stop_watching += [limit.close for limit in limits]
        return tuple(limits)

    def monitored(self, receiver: Receiver) -> tuple[Receiver, Leases | None]:
        """Return what receives the messages of a subscription, and the leases of its publishers.

        In real time that is ``receiver`` itself, and None.
        """
        if not self._is_virtual:
            return receiver, None
        loop, leases = self._context.loop, None
        lease_ms = self._port.qos.profile.liveliness_lease_duration_ms
        for event in self._subscription_events():
            on_overdue = self._on_overdue(event)
            if event.name == _DEADLINE_MISSED:
                receiver = MonitoredReceiver(loop, 1000.0 * event.period_s, on_overdue, receiver)
            elif event.name == _LIVELINESS_CHANGED and lease_ms is not None:
                leases = Leases(loop, lease_ms, on_overdue)
                self._stop_watching.append(leases.close)
        return receiver, leases

    def close(self) -> None:
        """Stop watching. Call it before the endpoint is destroyed."""
        self._incompatible.close()
        while self._stop_watching:  # each holds a file descriptor
            self._stop_watching.pop()()

    def _deadline(self, kind: IntEnum, verb: str) -> Iterator[EventKind]:
        deadline_ms = self._port.qos.profile.deadline_ms
        if deadline_ms is not None:
            text = f"nothing was {verb} within its deadline of {deadline_ms:g} ms"
            yield EventKind(_DEADLINE_MISSED, kind, text, period_s=deadline_ms / 1000.0)

    def _publisher_events(self) -> Iterator[EventKind]:
        yield from self._deadline(_PUBLISHER.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED, "published")
        lease_ms = self._port.qos.profile.liveliness_lease_duration_ms
        if lease_ms is not None:
            yield EventKind(
                _LIVELINESS_LOST,
                _PUBLISHER.RCL_PUBLISHER_LIVELINESS_LOST,
                f"it did not assert its liveliness within its lease of {lease_ms:g} ms",
                period_s=lease_ms / 1000.0,
            )

    def _subscription_events(self) -> Iterator[EventKind]:
        missed = _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED
        yield from self._deadline(missed, "received")
        lease_ms = self._port.qos.profile.liveliness_lease_duration_ms
        if lease_ms is not None:
            yield EventKind(
                _LIVELINESS_CHANGED,
                _SUBSCRIPTION.RCL_SUBSCRIPTION_LIVELINESS_CHANGED,
                f"a publisher did not assert its liveliness within the lease of {lease_ms:g} ms",
                lambda status: status.not_alive_count_change,  # negative for a recovery
            )
        yield EventKind(
            "message_lost",
            _SUBSCRIPTION.RCL_SUBSCRIPTION_MESSAGE_LOST,
            "a message was lost in transit",
            lambda status: status.total_count_change,
        )

    def _watch_incompatible(self, endpoint: Any, kind: IntEnum) -> None:
        call_soon = self._context.loop.call_soon
        stop = self._context.events.watch(endpoint, kind, lambda: call_soon(self._on_incompatible))
        self._stop_watching.append(stop)

    def _watch(self, endpoint: Any, event: EventKind) -> None:
        context = self._context

        def on_events(number: int) -> None:
            began_s = self._context.loop.clock.monotonic() - event.period_s
            context.loop.call_soon(partial(self._on_events, event, number, began_s))

        count = event.count
        if count is None:
            stop = context.events.watch(endpoint, event.kind, lambda: on_events(1))
        else:
            stop = context.events.watch_status(
                endpoint, event.kind, lambda status: on_events(count(status))
            )
        self._stop_watching.append(stop)

    def _on_overdue(self, event: EventKind) -> OnOverdue:
        """Return what is called when the period of an event has passed, in virtual time."""

        def on_overdue(since_s: float) -> None:
            now_s = self._context.loop.clock.monotonic()
            self._on_events(event, 1, since_s if event.period_s else now_s)

        return on_overdue

    def _on_events(self, event: EventKind, number: int, began_s: float) -> None:
        is_active = self._context.gate.incoming and began_s >= self._active_since_s
        if number <= 0 or not is_active:
            return
        self._context.statistics.qos_events[event.name] += number
        admission = self._repeats.admit(event.name, number)
        if admission is not None:
            name = f"{self._port.kind} '{self._port.name}' on {self._port.full_name}"
            text = f"{name}: {event.text}{self._publishers()}{admission.suffix}"
            self._context.log.warn(text)

    def _publishers(self) -> str:
        """Return the names of a subscription's publishers, to append to a sentence."""
        if self._port.kind is PortKind.PUBLISHER:
            return ""
        info = topic_info(self._context.node, self._port.full_name, ())
        names = sorted({publisher.name for publisher in info.publishers})
        return f"; it is published by {', '.join(names)}" if names else "; it has no publisher"

    def _on_incompatible(self) -> None:
        self._context.statistics.qos_events["incompatible"] += 1
        self._incompatible.check()
