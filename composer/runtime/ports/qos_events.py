"""QoS events of a publisher or a subscription: told by name, and counted.

rclpy tells of ends that do not fit by its own logger, and not whose they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
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
from composer.runtime.core import Core
from composer.runtime.ports.misfits import Misfits
from composer.runtime.repeated import Repeated
from composer.runtime.topic_ends import topic_info

_PUBLISHER = QoSPublisherEventType
_SUBSCRIPTION = QoSSubscriptionEventType
_KINDS = {
    PortKind.PUBLISHER: (
        _PUBLISHER.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        _PUBLISHER.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
    ),
    PortKind.SUBSCRIPTION: (
        _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        _SUBSCRIPTION.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
    ),
}


class QosEvents:
    """What rclpy makes the event handlers of one port with: its ``event_callbacks``.

    They are the same ones as rclpy itself makes. Deadlines and the own liveliness are counted as
    they are announced (:mod:`composer.runtime.announced_events`); nobody listens for lost messages
    and for the liveliness of others, which only a status could tell from their return. That a
    publisher has matched is for delivery to know (:class:`~composer.runtime.marks.MatchEvent`): rmw
    tells one callback of each kind of event.

    What goes on with a port of a node that is not active is nobody's concern: it is to be silent.
    """

    def __init__(self, core: Core, port: Port) -> None:
        self._core = core
        self._port = port
        self._misfits = Misfits(core, port)
        self._repeated: dict[str, Repeated] = {}
        self._ends: list[Callable[[], None]] = []

    def create_event_handlers(
        self, callback_group: CallbackGroup, endpoint: Any, _topic_name: str
    ) -> list[EventHandler]:
        """Return handlers of what the middleware has, and begin to count what is announced."""
        for event, wanted, text in self._announced():
            with suppress(UnsupportedEventTypeError):
                self._watch(endpoint, event, wanted, text)
        handlers = []
        for kind in _KINDS[self._port.kind]:
            with suppress(UnsupportedEventTypeError):
                handlers.append(
                    EventHandler(
                        callback_group=callback_group,
                        callback=self._take_misfit,
                        event_type=kind,
                        parent_impl=endpoint,
                    )
                )
        return handlers

    def close(self) -> None:
        """Tell nothing more. To be called before the endpoint is destroyed."""
        self._misfits.close()
        for end in self._ends:
            end()
        for repeated in self._repeated.values():
            repeated.close()

    def _announced(self) -> Iterator[tuple[str, IntEnum, str]]:
        """Yield what can happen: its name, its kind, and how it is told."""
        profile = self._port.qos.profile
        is_publisher = self._port.kind is PortKind.PUBLISHER
        if profile.deadline_ms is not None:
            what, kind = "nothing came", _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED
            if is_publisher:
                what = "nothing was published"
                kind = _PUBLISHER.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED
            text = f"{what} within its deadline of {profile.deadline_ms:g} ms"
            yield "deadline_missed", kind, text
        lease_ms = profile.liveliness_lease_duration_ms
        if is_publisher and lease_ms is not None:
            text = f"it gave no sign of life within its lease of {lease_ms:g} ms"
            yield "liveliness_lost", _PUBLISHER.RCL_PUBLISHER_LIVELINESS_LOST, text

    def _watch(self, endpoint: Any, event: str, kind: IntEnum, text: str) -> None:
        core, name = self._core, f"{self._port.kind} '{self._port.name}' on {self._port.full_name}"
        take = partial(self._take, event)
        self._ends.append(core.events.watch(endpoint, kind, lambda: core.loop.call_soon(take)))
        self._repeated[event] = Repeated(
            core.log, core.loop, lambda: f"{name}: {text}{self._publishers()}"
        )

    def _take(self, event: str) -> None:
        if self._core.gate.incoming:
            self._core.statistics.qos_events[event] += 1
            self._repeated[event].take()

    def _publishers(self) -> str:
        """Return whose messages a subscription waits for, to be added to a sentence."""
        if self._port.kind is PortKind.PUBLISHER:
            return ""
        info = topic_info(self._core.node, self._port.full_name, ())
        names = sorted({publisher.name for publisher in info.publishers})
        return f"; it is published by {', '.join(names)}" if names else "; nobody publishes it"

    def _take_misfit(self, _: Any) -> None:
        self._core.statistics.qos_events["incompatible"] += 1
        self._misfits.look()
