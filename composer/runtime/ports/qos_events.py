"""QoS events of a publisher or a subscription: told by name, and counted.

rclpy tells of ends that do not fit by its own logger, and not whose they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
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
from composer.runtime.ports.incompatible_qos import Misfits
from composer.runtime.ports.repeated import Repeated
from composer.runtime.ros.endpoints import topic_info

_PUBLISHER = QoSPublisherEventType
_SUBSCRIPTION = QoSSubscriptionEventType
#: Ends that do not fit, which are found when they meet.
_MISFITS = {
    PortKind.PUBLISHER: (
        _PUBLISHER.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
        _PUBLISHER.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
    ),
    PortKind.SUBSCRIPTION: (
        _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
        _SUBSCRIPTION.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
    ),
}


@dataclass(frozen=True, slots=True)
class _Event:
    """What can happen, how it is counted and how it is told.

    ``how_many`` says how often it happened by a status; without it, each announcement is once.
    """

    name: str
    kind: IntEnum
    text: str
    how_many: Callable[[Any], int] | None = None


class QosEvents:
    """What rclpy makes the event handlers of one port with: its ``event_callbacks``.

    There are none: ends that do not fit, deadlines and the own liveliness are counted as they are
    announced (``event_counts``); of lost messages and of the liveliness of
    others the status is taken, which tells how many, and loss from return. That a publisher has
    matched is for delivery to know (``MatchEvent``): rmw tells one
    callback of each kind of event.

    What goes on with a port of a node that is not active is nobody's concern: it is to be silent.
    """

    def __init__(self, core: NodeContext, port: Port) -> None:
        self._core = core
        self._port = port
        self._misfits = Misfits(core, port)
        self._repeated: dict[str, Repeated] = {}
        self._ends: list[Callable[[], None]] = []

    def create_event_handlers(
        self, _callback_group: CallbackGroup, endpoint: Any, _topic_name: str
    ) -> list[EventHandler]:
        """Begin to count what is announced, of what the middleware has; lost messages last."""
        for kind in _MISFITS[self._port.kind]:
            with suppress(UnsupportedEventTypeError):
                self._watch_misfits(endpoint, kind)
        is_publisher = self._port.kind is PortKind.PUBLISHER
        for event in self._of_publisher() if is_publisher else self._of_subscription():
            with suppress(UnsupportedEventTypeError):
                self._watch(endpoint, event)
        return []

    def close(self) -> None:
        """Tell nothing more. To be called before the endpoint is destroyed."""
        self._misfits.close()
        while self._ends:  # each holds a file descriptor
            self._ends.pop()()
        for repeated in self._repeated.values():
            repeated.close()

    def _of_publisher(self) -> Iterator[_Event]:
        profile = self._port.qos.profile
        if profile.deadline_ms is not None:
            yield _Event(
                "deadline_missed",
                _PUBLISHER.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
                f"nothing was published within its deadline of {profile.deadline_ms:g} ms",
            )
        lease_ms = profile.liveliness_lease_duration_ms
        if lease_ms is not None:
            yield _Event(
                "liveliness_lost",
                _PUBLISHER.RCL_PUBLISHER_LIVELINESS_LOST,
                f"it gave no sign of life within its lease of {lease_ms:g} ms",
            )

    def _of_subscription(self) -> Iterator[_Event]:
        profile = self._port.qos.profile
        if profile.deadline_ms is not None:
            yield _Event(
                "deadline_missed",
                _SUBSCRIPTION.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,
                f"nothing came within its deadline of {profile.deadline_ms:g} ms",
            )
        lease_ms = profile.liveliness_lease_duration_ms
        if lease_ms is not None:
            yield _Event(
                "liveliness_changed",
                _SUBSCRIPTION.RCL_SUBSCRIPTION_LIVELINESS_CHANGED,
                f"a publisher gave no sign of life within the lease of {lease_ms:g} ms",
                lambda status: status.not_alive_count_change,  # less than none: one has come back
            )
        yield _Event(
            "message_lost",
            _SUBSCRIPTION.RCL_SUBSCRIPTION_MESSAGE_LOST,
            "a message was lost on its way",
            lambda status: status.total_count_change,
        )

    def _watch_misfits(self, endpoint: Any, kind: IntEnum) -> None:
        loop = self._core.loop
        end = self._core.events.watch(endpoint, kind, lambda: loop.call_soon(self._take_misfit))
        self._ends.append(end)

    def _watch(self, endpoint: Any, event: _Event) -> None:
        core, name = self._core, f"{self._port.kind} '{self._port.name}' on {self._port.full_name}"

        def happened(number: int) -> None:
            core.loop.call_soon(partial(self._take, event.name, number))

        how_many = event.how_many
        if how_many is None:
            end = core.events.watch(endpoint, event.kind, lambda: happened(1))
        else:
            end = core.events.watch_status(endpoint, event.kind, lambda it: happened(how_many(it)))
        self._ends.append(end)
        self._repeated[event.name] = Repeated(
            core.log, core.loop, lambda: f"{name}: {event.text}{self._publishers()}"
        )

    def _take(self, event: str, number: int) -> None:
        if number > 0 and self._core.gate.incoming:
            self._core.statistics.qos_events[event] += number
            self._repeated[event].take(number)

    def _publishers(self) -> str:
        """Return whose messages a subscription waits for, to be added to a sentence."""
        if self._port.kind is PortKind.PUBLISHER:
            return ""
        info = topic_info(self._core.node, self._port.full_name, ())
        names = sorted({publisher.name for publisher in info.publishers})
        return f"; it is published by {', '.join(names)}" if names else "; nobody publishes it"

    def _take_misfit(self) -> None:
        self._core.statistics.qos_events["incompatible"] += 1
        self._misfits.look()
