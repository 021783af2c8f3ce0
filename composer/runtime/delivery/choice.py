"""Which topics are delivered in the process: decided once, from the model alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from composer.model import Channel, ChannelKind, Delivery, System, channels
from composer.qos import Liveliness, QosProfile
from composer.runtime.manager import NAME, STATE_TOPIC

#: What the runtime and rclpy publish themselves, not through ports.
_NOT_BY_PORTS = frozenset({"/rosout", "/parameter_events", "/diagnostics"})
_ENDINGS_NOT_BY_PORTS = ("/transition_event", f"/{NAME}/{STATE_TOPIC}")


def shared_topics(system: System) -> Mapping[str, str | None]:
    """Return the topics with ports at both ends, and why each goes by DDS alone, if it does.

    A subscription ignores all of its process's DDS publications or none, so what one port of a
    topic cannot do, the topic does not do.
    """
    return {
        channel.name: _objection(channel, system.delivery)
        for channel in channels(system.nodes)
        if channel.kind is ChannelKind.TOPIC and channel.sources and channel.sinks
    }


def _objection(channel: Channel, unless_said: Delivery) -> str | None:
    if any((end.port.delivery or unless_said) is Delivery.DDS for end in channel.ends):
        return "'delivery: dds' says so"
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
