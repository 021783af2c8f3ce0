"""The rates of publishers, topics and callbacks, as far as the declaration determines them.

A rate is a maximum: messages that depend on a condition may be less frequent.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from composer.analysis.context import Context
from composer.analysis.timing.publications import Cause, Causes, causes
from composer.fast_dataclass import dataclass
from composer.model import ChannelKind, Node, PortKind, PortOfNode


def timed_publishers(context: Context) -> tuple[tuple[PortOfNode, float], ...]:
    """Return every publisher that only timers publish through, with the shortest period.

    The period is in seconds.
    """
    found = []
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.PUBLISHER):
            of_port = context.once(causes).get(_key(PortOfNode(node, port)), ())
            periods = [
                node.period_s(cause.timer) if cause.timer is not None else None for cause in of_port
            ]
            known = [period_s for period_s in periods if period_s is not None]
            if known and len(known) == len(periods):
                found.append((PortOfNode(node, port), min(known)))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Rates:
    """Rates in hertz; None if unknown."""

    causes: Causes
    topics: Mapping[str, float | None]

    def topic_hz(self, name: str) -> float | None:
        """Return the rate of messages on a topic."""
        return self.topics.get(name)

    def publisher_hz(self, endpoint: PortOfNode) -> float | None:
        """Return the rate of messages from a publisher."""
        return _publisher_hz(self.causes, self.topics, endpoint)

    def callback_hz(self, node: Node, cause: Cause) -> float | None:
        """Return the rate of the callback of a timer or a subscription."""
        return _callback_hz(self.topics, node, cause)


def rates(context: Context) -> Rates:
    """Return the rates of a system."""
    known = context.once(causes)
    publishers = {
        channel.name: channel.sources
        for channel in context.channels
        if channel.kind is ChannelKind.TOPIC
        and channel.sources
        and not any(
            endpoint.port.external for endpoint in channel.sinks
        )  # external nodes publish there, too
    }
    topics: dict[str, float | None] = {}
    for name in _in_order_of_cause(known, publishers):
        topics[name] = _total(
            _publisher_hz(known, topics, endpoint) for endpoint in publishers[name]
        )
    return Rates(known, topics)


def _in_order_of_cause(
    known: Causes, publishers: Mapping[str, tuple[PortOfNode, ...]]
) -> Iterator[str]:
    """Yield the topics, each after those whose messages cause messages on it.

    Topics in a cycle are left out: they have no rate.
    """
    missing_causes: dict[str, int] = {}
    effects: dict[str, list[str]] = {}
    for name, endpoints in publishers.items():
        causing = {
            cause.port.full_name
            for endpoint in endpoints
            for cause in known.get(_key(endpoint), ())
            if cause.port is not None and cause.port.full_name in publishers
        }
        missing_causes[name] = len(causing)
        for other in causing:
            effects.setdefault(other, []).append(name)
    ready = [name for name, count in missing_causes.items() if not count]
    while ready:
        name = ready.pop()
        yield name
        for effect in effects.get(name, ()):
            missing_causes[effect] -= 1
            if not missing_causes[effect]:
                ready.append(effect)


def _publisher_hz(
    known: Causes, topics: Mapping[str, float | None], endpoint: PortOfNode
) -> float | None:
    found = known.get(_key(endpoint))
    if found is None:
        return None
    return _total(_callback_hz(topics, endpoint.node, cause) for cause in found)


def _callback_hz(topics: Mapping[str, float | None], node: Node, cause: Cause) -> float | None:
    if cause.timer is not None:
        period_s = node.period_s(cause.timer)
        return 1.0 / period_s if period_s is not None else None
    port = cause.port
    if port is None or port.kind is not PortKind.SUBSCRIPTION:
        return None
    return topics.get(port.full_name)


def _total(found: Iterable[float | None]) -> float | None:
    """Return the sum; None if any term is unknown."""
    total = 0.0
    for rate_hz in found:
        if rate_hz is None:
            return None
        total += rate_hz
    return total


def _key(endpoint: PortOfNode) -> tuple[str, str]:
    return endpoint.node.name.value, endpoint.port.name.value
