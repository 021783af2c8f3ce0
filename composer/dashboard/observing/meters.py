"""Rates and sizes of topics, measured while anything shows them.

Messages are taken as bytes and not deserialized. Sequence numbers show how many were published in
between, so the rate is right although a fast topic is not read completely.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import field
from functools import partial
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass
from composer.dashboard.observing.large_messages import LARGE_BYTES, LARGE_TYPES, large_profile
from composer.model import PortKind
from composer.model.qos import Durability, QosProfile, Reliability
from composer.runtime.metrics.message_rate import MessageRate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from composer.client.shared_session import SampledTopic, SharedSession
    from composer.plan.drift import ObservedEndpoint

_DEPTH = 100
_MAX_TAKEN = 200


@dataclass(frozen=True, slots=True)
class TopicFigures:
    """What was measured of a topic; None where it is not known yet.

    ``lost`` counts messages that did not arrive, without those that waited here for too long.
    """

    rate_hz: float | None
    bytes_per_s: float | None
    mean_bytes: float | None
    age_s: float | None
    messages: int
    lost: int


@dataclass(slots=True)
class _Meter:
    subscribe: Callable[[QosProfile], SampledTopic]
    profile: QosProfile
    sampled: SampledTopic
    has_one_publisher: bool
    users: int = 0
    messages: int = 0
    lost: int = 0
    last_number: int = 0
    rate: MessageRate = field(default_factory=MessageRate)


class TopicMeters:
    """Measures topics. Use it on the thread of feeds."""

    def __init__(self, session: SharedSession) -> None:
        self._session = session
        self._meters: dict[str, _Meter] = {}

    def acquire(self, topic: str, ends: Sequence[ObservedEndpoint]) -> bool:
        """Measure a topic with these endpoints. Return whether that is possible.

        It is not without a publisher, with several types, or if the type is not installed.
        """
        known = self._meters.get(topic)
        if known is not None:
            known.users += 1
            return True
        from composer.client.messages.values import InvalidValueError

        publishers = [end for end in ends if end.kind is PortKind.PUBLISHER]
        types = {end.type for end in ends}
        if not publishers or len(types) != 1:
            return False
        (type_name,) = types
        profile = _profile(publishers)
        if type_name in LARGE_TYPES:
            profile = large_profile(profile)
        subscribe = partial(self._session.sample, topic, type_name, raw=True)
        try:
            sampled = subscribe(profile)
        except InvalidValueError:
            return False
        self._meters[topic] = _Meter(subscribe, profile, sampled, len(publishers) == 1, users=1)
        return True

    def release(self, topic: str) -> None:
        """Stop measuring a topic once every user has released it."""
        meter = self._meters.get(topic)
        if meter is not None:
            meter.users -= 1
            if not meter.users:
                meter.sampled.close()
                del self._meters[topic]

    def poll(self) -> None:
        """Take the messages that have arrived."""
        for meter in self._meters.values():
            _take(meter)

    def figures(self, topic: str) -> TopicFigures | None:
        """Return the figures of a topic, None if it is not measured."""
        meter = self._meters.get(topic)
        return None if meter is None else _figures(meter, time.time())

    def close(self) -> None:
        """Stop measuring."""
        for meter in self._meters.values():
            meter.sampled.close()
        self._meters.clear()


def _profile(publishers: Sequence[ObservedEndpoint]) -> QosProfile:
    """Return a profile for measurements: messages from before the subscription do not arrive."""
    reliable = all(
        end.qos is not None and end.qos.reliability is Reliability.RELIABLE for end in publishers
    )
    return QosProfile(
        depth=_DEPTH,
        reliability=Reliability.RELIABLE if reliable else Reliability.BEST_EFFORT,
        durability=Durability.VOLATILE,
    )


def _take(meter: _Meter) -> None:
    samples = meter.sampled.take(_MAX_TAKEN)
    is_complete = len(samples) < meter.profile.depth
    for sample in samples:
        missed = 0
        if meter.has_one_publisher and 0 < meter.last_number < sample.number:
            missed = sample.number - meter.last_number - 1
            meter.lost += missed * is_complete
        meter.last_number = sample.number
        meter.messages += 1
        meter.rate.add(sample.at_s, len(sample.content), missed)
    large = large_profile(meter.profile)
    if large != meter.profile and any(len(sample.content) >= LARGE_BYTES for sample in samples):
        meter.sampled.close()
        meter.profile, meter.sampled = large, meter.subscribe(large)
        meter.last_number = 0


def _figures(meter: _Meter, now_s: float) -> TopicFigures:
    rate = meter.rate
    rate_hz, mean_bytes = rate.current_hz(now_s), rate.mean_bytes
    if mean_bytes is None:
        return TopicFigures(None, None, None, None, 0, 0)
    return TopicFigures(
        rate_hz=rate_hz,
        bytes_per_s=None if rate_hz is None else rate_hz * mean_bytes,
        mean_bytes=mean_bytes,
        age_s=max(0.0, now_s - rate.last_s),
        messages=meter.messages,
        lost=meter.lost,
    )
