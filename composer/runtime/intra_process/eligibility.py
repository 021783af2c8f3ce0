"""Which topics, services and actions stay in the process: decided from the model alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

from composer.model import Channel, ChannelKind, Delivery, Port, System, channels
from composer.qos import Liveliness, QosProfile, incompatibilities
from composer.runtime.ros.manager_protocol import CALLBACKS_TOPIC, NAME, STATE_TOPIC

#: Topics that the runtime and rclpy publish themselves, without ports.
_NOT_BY_PORTS = frozenset({"/rosout", "/parameter_events", "/diagnostics"})
_ENDINGS_NOT_BY_PORTS = (
    "/transition_event",
    f"/{NAME}/{STATE_TOPIC}",
    f"/{NAME}/{CALLBACKS_TOPIC}",
)


#: A topic, service or action by kind and full name.
ChannelKey: TypeAlias = tuple[ChannelKind, str]


def channel_of(port: Port) -> ChannelKey:
    """Return the channel of the port."""
    return port.kind.channel, port.full_name


def shared_channels(system: System) -> Mapping[ChannelKey, str | None]:
    """Return the channels with local ports at both endpoints, each with the reason it needs DDS.

    The reason is None for channels that stay in the process. A subscription ignores either all or
    none of the publications of its process, so one port that needs DDS decides for the topic.
    """
    return {
        (channel.kind, channel.name): _dds_reason(channel, system.delivery)
        for channel in channels(
            (node for node in system.nodes if node.in_process), with_transforms=True
        )
        if channel.sources and channel.sinks
    }


def _dds_reason(channel: Channel, default: Delivery) -> str | None:
    if any((end.port.delivery or default) is Delivery.DDS for end in channel.ends):
        return "'delivery: dds' is set"
    if channel.kind is ChannelKind.TOPIC:
        return _topic_reason(channel)
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


def _topic_reason(channel: Channel) -> str | None:
    if channel.name in _NOT_BY_PORTS or channel.name.endswith(_ENDINGS_NOT_BY_PORTS):
        return "the runtime publishes it too"
    if _is_timed(end.port.qos.profile for end in channel.ends):
        return "its QoS has a deadline, lifespan or liveliness, which only the middleware monitors"
    return None


def _is_timed(profiles: Iterable[QosProfile]) -> bool:
    return any(
        profile.deadline_ms is not None
        or profile.lifespan_ms is not None
        or profile.liveliness is not Liveliness.AUTOMATIC
        or profile.liveliness_lease_duration_ms is not None
        for profile in profiles
    )
