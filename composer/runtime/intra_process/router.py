"""Connects the ports of a system within the process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from composer.model import ChannelKind, Port
from composer.runtime.intra_process.action import LocalActionServer
from composer.runtime.intra_process.eligibility import ChannelKey, channel_of
from composer.runtime.intra_process.ignore_local_publications import (
    ignore_local,
    unsupported_reason,
)
from composer.runtime.intra_process.publisher import GatedPublisher, PublisherContext
from composer.runtime.intra_process.service import LocalService
from composer.runtime.intra_process.topic import (
    LocalSubscription,
    Receiver,
    Topic,
    local_publisher_for,
)

S = TypeVar("S")

Remove = Callable[[], None]


class LocalRouter:
    """The topics, services and actions of one system that stay in the process.

    Ports join with their DDS endpoint, which exists in any case, and leave before they destroy it.
    So the local endpoints among the matched ones are always known, and the others are external.
    """

    def __init__(self, shared: Mapping[ChannelKey, str | None]) -> None:
        """``shared`` has the channels with ports at both endpoints, and why they need DDS, if any.

        rclpy must be initialized.
        """
        self._dds_reasons = dict(shared)
        #: Why eligible topics use DDS nevertheless; None if they do not.
        self.refusal: str | None = None
        self._topics: dict[ChannelKey, Topic] = {}
        self._services: dict[ChannelKey, LocalService] = {}
        self._action_servers: dict[ChannelKey, LocalActionServer] = {}
        for key in [key for key, reason in shared.items() if reason is None]:
            if key[0] is not ChannelKind.TOPIC:
                continue
            self.refusal = unsupported_reason()
            if self.refusal is None:
                self._topics[key] = Topic()
            else:
                self._dds_reasons[key] = self.refusal

    def dds_reason(self, port: Port) -> str | None:
        """Return why the port uses DDS although the other endpoint is in-process, or None."""
        return self._dds_reasons.get(channel_of(port))

    def delivers(self, port: Port) -> bool:
        """Return whether the topic or service of the port is delivered in the process."""
        return self._dds_reasons.get(channel_of(port), "") is None

    def add_publisher(
        self, port: Port, publisher: Publisher, context: PublisherContext
    ) -> tuple[GatedPublisher, Remove]:
        """Return the publisher that a node uses for the port, and a function that removes it."""
        topic = self._topics.get(channel_of(port))
        if topic is None:
            return GatedPublisher(publisher, context), _do_nothing
        local = local_publisher_for(publisher, context, port)
        topic.add_publisher(local)
        return local, lambda: topic.remove_publisher(local)

    def add_subscription(
        self, port: Port, subscription: Subscription, receiver: Receiver
    ) -> Remove:
        """Pass local publications to ``receiver``; return a function that stops that."""
        topic = self._topics.get(channel_of(port))
        if topic is None:
            return receiver.close
        ignore_local(subscription)
        local = LocalSubscription(subscription.msg_type, port, receiver)
        topic.add_subscription(local)
        return lambda: topic.remove_subscription(local)

    def add_service(self, port: Port, service: LocalService) -> Remove:
        """Offer ``service`` to clients of the process; return a function that stops that."""
        return self._add(self._services, port, service)

    def service_lookup(self, port: Port) -> Callable[[], LocalService | None]:
        """Return a function that returns the local service of a client port now, if any."""
        return partial(self._services.get, channel_of(port))

    def add_action_server(self, port: Port, server: LocalActionServer) -> Remove:
        """Offer ``server`` to action clients of the process; return a function that stops that."""
        return self._add(self._action_servers, port, server)

    def action_server_lookup(self, port: Port) -> Callable[[], LocalActionServer | None]:
        """Return a function that returns the local server of an action client port now, if any."""
        return partial(self._action_servers.get, channel_of(port))

    def _add(self, servers: dict[ChannelKey, S], port: Port, server: S) -> Remove:
        key = channel_of(port)
        if key not in self._dds_reasons or self._dds_reasons[key] is not None:
            return _do_nothing
        servers[key] = server

        def remove() -> None:
            if servers.get(key) is server:
                del servers[key]

        return remove


def _do_nothing() -> None:
    """Remove nothing: the channel is not shared."""
