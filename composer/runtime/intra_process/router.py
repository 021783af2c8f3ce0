"""Where the ports of a system meet within the process."""

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
    ignore_own_publications,
    why_not_ignored,
)
from composer.runtime.intra_process.publisher import Origin, Sender
from composer.runtime.intra_process.service import Server
from composer.runtime.intra_process.topic import LocalSubscription, Receiver, Topic, outlet_for

S = TypeVar("S")

Leave = Callable[[], None]


class Delivery:
    """The topics, services and actions of one system that stay in the process.

    Ports join with their DDS endpoint, which they have all the same, and leave before they destroy
    it: own endpoints that have matched are known at any time, so the others are outsiders.
    """

    def __init__(self, shared: Mapping[ChannelKey, str | None]) -> None:
        """``shared`` tells what has ports at both ends, and why DDS has to do, where it has to.

        rclpy must be initialized.
        """
        self._objections = dict(shared)
        #: Why topics go by DDS that the system would have stay; None where none do.
        self.refusal: str | None = None
        self._topics: dict[ChannelKey, Topic] = {}
        self._servers: dict[ChannelKey, Server] = {}
        self._action_servers: dict[ChannelKey, LocalActionServer] = {}
        for key in [key for key, objection in shared.items() if objection is None]:
            if key[0] is not ChannelKind.TOPIC:
                continue
            self.refusal = why_not_ignored()
            if self.refusal is None:
                self._topics[key] = Topic()
            else:
                self._objections[key] = self.refusal

    def objection(self, port: Port) -> str | None:
        """Return why DDS has to do although the other end is in the process, or None."""
        return self._objections.get(channel_of(port))

    def add_publisher(
        self, port: Port, publisher: Publisher, origin: Origin
    ) -> tuple[Sender, Leave]:
        """Return what sends the messages of the port, and what ends that."""
        topic = self._topics.get(channel_of(port))
        if topic is None:
            return Sender(publisher, origin), _nothing
        outlet = outlet_for(publisher, origin, port)
        topic.add_outlet(outlet)
        return outlet, lambda: topic.remove_outlet(outlet)

    def add_subscription(self, port: Port, subscription: Subscription, receiver: Receiver) -> Leave:
        """Hand ``receiver`` what is published in the process; return what ends that."""
        topic = self._topics.get(channel_of(port))
        if topic is None:
            return receiver.close
        ignore_own_publications(subscription)
        inlet = LocalSubscription(subscription.msg_type, port, receiver)
        topic.add_inlet(inlet)
        return lambda: topic.remove_inlet(inlet)

    def add_server(self, port: Port, server: Server) -> Leave:
        """Let clients of the process find ``server``; return what ends that."""
        return self._add(self._servers, port, server)

    def find_server(self, port: Port) -> Callable[[], Server | None]:
        """Return what finds the server in the process that the client port reaches now, if any."""
        return partial(self._servers.get, channel_of(port))

    def add_action_server(self, port: Port, server: LocalActionServer) -> Leave:
        """Let action clients of the process find ``server``; return what ends that."""
        return self._add(self._action_servers, port, server)

    def find_action_server(self, port: Port) -> Callable[[], LocalActionServer | None]:
        """Return what finds the server in the process that the action client port reaches now."""
        return partial(self._action_servers.get, channel_of(port))

    def _add(self, servers: dict[ChannelKey, S], port: Port, server: S) -> Leave:
        key = channel_of(port)
        if key not in self._objections or self._objections[key] is not None:
            return _nothing
        servers[key] = server

        def leave() -> None:
            if servers.get(key) is server:
                del servers[key]

        return leave


def _nothing() -> None:
    """Leave what was never joined."""
