"""Connects the ports of a system within the process.

Which topics, services and actions stay in the process is decided from the model alone.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias, TypeVar

from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

from composer.model import Channel, ChannelKind, Delivery, Port, System, channels
from composer.model.qos import Liveliness, QosProfile, incompatibilities
from composer.runtime.host_options import Instruments, Recorder
from composer.runtime.intra_process.dds_flags import (
    ignore_local,
    unsupported_reason,
)
from composer.runtime.intra_process.publisher import GatedPublisher, PublisherContext
from composer.runtime.intra_process.servers import (
    CallSoon,
    LocalActionServer,
    LocalService,
    Receive,
)
from composer.runtime.intra_process.taps import tap_of
from composer.runtime.intra_process.topic import (
    Leases,
    LocalSubscription,
    Receiver,
    Topic,
    local_publisher_for,
)
from composer.runtime.protocol.requests import CALLBACKS_TOPIC, NAME, STATE_TOPIC

#: Topics that the runtime and rclpy publish themselves, without ports.
_NOT_BY_PORTS = frozenset({"/rosout", "/parameter_events", "/diagnostics"})
_ENDINGS_NOT_BY_PORTS = (
    "/transition_event",
    f"/{NAME}/{STATE_TOPIC}",
    f"/{NAME}/{CALLBACKS_TOPIC}",
)


#: A topic, service or action by kind and full name.
ChannelKey: TypeAlias = tuple[ChannelKind, str]
S = TypeVar("S")
Remove = Callable[[], None]


def channel_of(port: Port) -> ChannelKey:
    """Return the channel of the port."""
    return port.kind.channel, port.full_name


def shared_channels(
    system: System, *, in_virtual_time: bool = False
) -> Mapping[ChannelKey, str | None]:
    """Return the channels with local ports at both endpoints, each with the reason it needs DDS.

    The reason is None for channels that stay in the process. A subscription ignores either all or
    none of the publications of its process, so one port that needs DDS decides for the topic. Time
    limits of QoS profiles are a reason in real time only.
    """
    return {
        (channel.kind, channel.name): _dds_reason(channel, system.delivery, in_virtual_time)
        for channel in channels(
            (node for node in system.nodes if node.in_process), with_transforms=True
        )
        if channel.sources and channel.sinks
    }


def _dds_reason(channel: Channel, default: Delivery, in_virtual_time: bool) -> str | None:
    if any((end.port.delivery or default) is Delivery.DDS for end in channel.ends):
        return "'delivery: dds' is set"
    if channel.kind is ChannelKind.TOPIC:
        return _topic_reason(channel, in_virtual_time)
    return _server_reason(channel)


def _server_reason(channel: Channel) -> str | None:
    if len(channel.sources) > 1:
        return "it has several servers"
    server = channel.sources[0].port
    for client in (sink.port for sink in channel.sinks):
        if client.interface.value != server.interface.value:
            return "its endpoints have different types"
        profiles = client.qos.profile, server.qos.profile
        if incompatibilities(*profiles) or incompatibilities(*reversed(profiles)):
            return "its endpoints have incompatible QoS"
    return None


def _topic_reason(channel: Channel, in_virtual_time: bool) -> str | None:
    if channel.name in _NOT_BY_PORTS or channel.name.endswith(_ENDINGS_NOT_BY_PORTS):
        return "the runtime publishes it too"
    if not in_virtual_time and any(_is_timed(end.port.qos.profile) for end in channel.ends):
        return "its QoS has a deadline, lifespan or liveliness, which only the middleware monitors"
    return None


def _is_timed(profile: QosProfile) -> bool:
    return (
        profile.deadline_ms is not None
        or profile.lifespan_ms is not None
        or profile.liveliness is not Liveliness.AUTOMATIC
        or profile.liveliness_lease_duration_ms is not None
    )


class LocalRouter:
    """The topics, services and actions of one system that stay in the process.

    Ports join with their DDS endpoint, which exists in any case, and leave before they destroy it.
    So the local endpoints among the matched ones are always known, and the others are external.
    """

    def __init__(
        self,
        shared: Mapping[ChannelKey, str | None],
        instruments: Instruments | None = None,
        recorder: Recorder | None = None,
        *,
        in_virtual_time: bool = False,
    ) -> None:
        """``shared`` has the channels with ports at both endpoints, and why they need DDS, if any.

        ``instruments`` belong to a test; ``recorder`` receives what nodes send. In virtual time,
        channels that are not declared stay in the process as well. rclpy must be initialized.
        """
        self._shares_undeclared = in_virtual_time
        self._instruments = instruments
        self.recorder = recorder
        self._dds_reasons = dict(shared)
        #: Why eligible topics use DDS nevertheless; None if they do not.
        self.refusal: str | None = None
        self._topics: dict[ChannelKey, Topic] = {}
        self._services: dict[ChannelKey, LocalService] = {}
        self._action_servers: dict[ChannelKey, LocalActionServer] = {}
        if in_virtual_time:
            self.refusal = unsupported_reason()
        for key in [key for key, reason in shared.items() if reason is None]:
            if key[0] is ChannelKind.TOPIC:
                self.refusal = self._dds_reasons[key] = unsupported_reason()

    def dds_reason(self, port: Port) -> str | None:
        """Return why the port uses DDS although the other endpoint is in-process, or None."""
        return self._dds_reasons.get(channel_of(port))

    def delivers(self, port: Port) -> bool:
        """Return whether the topic or service of the port is delivered in the process."""
        return self._is_local(channel_of(port))

    def add_publisher(
        self, port: Port, publisher: Publisher, context: PublisherContext
    ) -> tuple[GatedPublisher, Remove]:
        """Return the publisher that a node uses for the port, and a function that removes it."""
        type_name, profile = port.interface.value, port.qos.profile
        tap = tap_of(self.recorder, port, port.full_name, type_name, profile)
        if tap is not None:
            context = replace(context, observers=(*context.observers, tap))
        topic = self._topic(port)
        if topic is None:
            return GatedPublisher(publisher, context), _do_nothing
        local = local_publisher_for(publisher, context, port)
        topic.add_publisher(local)
        return local, lambda: topic.remove_publisher(local)

    def add_subscription(
        self,
        port: Port,
        subscription: Subscription,
        receiver: Receiver,
        leases: Leases | None = None,
    ) -> Remove:
        """Pass local publications to ``receiver``; return a function that stops that.

        ``leases`` has the leases of the publishers, if the runtime monitors them.
        """
        topic = self._topic(port)
        if topic is None:
            return receiver.close
        ignore_local(subscription)
        if self._instruments is not None:
            receiver = self._instruments.receiver(port, receiver)
        local = LocalSubscription(subscription.msg_type, port, receiver, leases)
        topic.add_subscription(local)
        return lambda: topic.remove_subscription(local)

    def add_service(self, port: Port, service: LocalService) -> Remove:
        """Offer ``service`` to clients of the process; return a function that stops that."""
        return self._add(self._services, channel_of(port), service)

    def offer(self, service: Any, call_soon: CallSoon, receive: Receive) -> None:
        """Offer a service that no port declares, such as a node's parameter services.

        In virtual time only: otherwise, its clients use the middleware.
        """
        name = service.service_name
        local = LocalService(name, service.srv_type, call_soon, receive)
        self._add(self._services, (ChannelKind.SERVICE, name), local)

    def withdraw(self, service: Any) -> None:
        """End :meth:`offer`."""
        self._services.pop((ChannelKind.SERVICE, service.service_name), None)

    def service_lookup(self, port: Port) -> Callable[[], LocalService | None]:
        """Return a function that returns the local service of a client port now, if any."""
        return partial(self._services.get, channel_of(port))

    def add_action_server(self, port: Port, server: LocalActionServer) -> Remove:
        """Offer ``server`` to action clients of the process; return a function that stops that."""
        return self._add(self._action_servers, channel_of(port), server)

    def action_server_lookup(self, port: Port) -> Callable[[], LocalActionServer | None]:
        """Return a function that returns the local server of an action client port now, if any."""
        return partial(self._action_servers.get, channel_of(port))

    def _is_local(self, key: ChannelKey) -> bool:
        return self._dds_reasons.get(key, None if self._shares_undeclared else "") is None

    def _topic(self, port: Port) -> Topic | None:
        key = channel_of(port)
        return self._topics.setdefault(key, Topic()) if self._is_local(key) else None

    def _add(self, servers: dict[ChannelKey, S], key: ChannelKey, server: S) -> Remove:
        if not self._is_local(key):
            return _do_nothing
        servers[key] = server

        def remove() -> None:
            if servers.get(key) is server:
                del servers[key]

        return remove


def _do_nothing() -> None:
    """Remove nothing: the channel is not shared."""
