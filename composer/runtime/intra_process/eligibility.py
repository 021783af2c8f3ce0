"""Which topics, services and actions stay in the process: decided once, from the model alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

from composer.model import Channel, ChannelKind, Delivery, Port, System, channels
from composer.qos import Liveliness, QosProfile, incompatibilities
from composer.runtime.ros.manager_protocol import CALLBACKS_TOPIC, NAME, STATE_TOPIC

#: What the runtime and rclpy publish themselves, not through ports.
_NOT_BY_PORTS = frozenset({"/rosout", "/parameter_events", "/diagnostics"})
_ENDINGS_NOT_BY_PORTS = (
    "/transition_event",
    f"/{NAME}/{STATE_TOPIC}",
    f"/{NAME}/{CALLBACKS_TOPIC}",
)


#: What ports meet on.
ChannelKey: TypeAlias = tuple[ChannelKind, str]


def channel_of(port: Port) -> ChannelKey:
    """Return what the port meets others on."""
    return port.kind.channel, port.full_name


def shared_channels(system: System) -> Mapping[ChannelKey, str | None]:
    """Return what has ports at both ends, and why DDS has to do, where it has to.

    A subscription ignores all of its process's DDS publications or none, so what one port of a
    topic cannot do, the topic does not do.
    """
    return {
        (channel.kind, channel.name): _objection(channel, system.delivery)
        for channel in channels(system.nodes)
        if channel.sources and channel.sinks
    }


def _objection(channel: Channel, unless_said: Delivery) -> str | None:
    if any((end.port.delivery or unless_said) is Delivery.DDS for end in channel.ends):
        return "'delivery: dds' says so"
    if channel.kind is ChannelKind.TOPIC:
        return _objection_to_topic(channel)
    return _objection_to_server(channel)


def _objection_to_server(channel: Channel) -> str | None:
    if len(channel.sources) > 1:
        return "it has several servers"
    server = channel.sources[0].port
    for client in (sink.port for sink in channel.sinks):
        if client.interface.value != server.interface.value:
            return "its ends have different types"
        ends = client.qos.profile, server.qos.profile
        if incompatibilities(*ends) or incompatibilities(*reversed(ends)):
            return "the QoS of its ends keeps them apart"
    return None


def _objection_to_topic(channel: Channel) -> str | None:
    if channel.name in _NOT_BY_PORTS or channel.name.endswith(_ENDINGS_NOT_BY_PORTS):
        return "not only ports publish it"
    if _is_timed(end.port.qos.profile for end in channel.ends):
        return "its QoS has a deadline, a lifespan or a liveliness that the middleware watches"
    return None


def _is_timed(profiles: Iterable[QosProfile]) -> bool:
    return any(
        profile.deadline_ms is not None
        or profile.lifespan_ms is not None
        or profile.liveliness is not Liveliness.AUTOMATIC
        or profile.liveliness_lease_duration_ms is not None
        for profile in profiles
    )
