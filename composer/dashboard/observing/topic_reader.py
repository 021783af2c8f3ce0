"""One topic whose messages a channel shows: finds its type and QoS, and follows changes of both.

Of large messages, and of more bytes per second than a reader can use, some are skipped.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from composer.dashboard.observing.large_messages import (
    LARGE_BYTES,
    LARGE_TYPES,
    ByteLimit,
    large_profile,
)
from composer.dashboard.protocol.messages import RequestError
from composer.model import PortKind

if TYPE_CHECKING:
    from composer.client.shared_session import Sample, SampledTopic
    from composer.dashboard.ros_side import RosGraphSide
    from composer.model.qos import QosProfile
    from composer.plan.drift import ObservedEndpoint


class TopicReader:
    """Reads a topic as bytes. Use it on the thread of feeds.

    ``lost`` counts the messages that were published and not read.
    """

    def __init__(self, ros: RosGraphSide, topic: str, type_name: str | None, depth: int) -> None:
        """Begin at the first call of :meth:`take`; without a type, it is that of the publishers."""
        self.topic = topic
        self.type_name = type_name or ""
        self.lost = 0
        self._ros = ros
        self._given_type = type_name
        self._depth = depth
        self._limit = ByteLimit()
        self._is_large = False
        self._sampled: SampledTopic | None = None
        self._profile: QosProfile | None = None
        self._last_number = 0

    def take(self, limit: int) -> list[Sample]:
        """Return the messages that have arrived, at most ``limit``.

        Raises RosError, RequestError if the topic has no publisher or no single, installed type.
        """
        self._subscribe()
        if self._sampled is None or not self._limit.allows(time.monotonic()):
            return []  # what waits too long is dropped by DDS, without being copied
        samples = self._sampled.take(limit)
        for sample in samples:
            size = len(sample.content)
            self._limit.count(size)
            self._is_large = self._is_large or size >= LARGE_BYTES
            if 0 < self._last_number < sample.number:
                self.lost += sample.number - self._last_number - 1
            self._last_number = sample.number
        return samples

    def message(self, sample: Sample) -> object:
        """Return the message of a sample."""
        assert self._sampled is not None  # noqa: S101 - it is the source of the sample
        return self._sampled.message(sample)

    def close(self) -> None:
        """Unsubscribe."""
        if self._sampled is not None:
            self._sampled.close()
        self._sampled, self._profile = None, None

    def _subscribe(self) -> None:
        """Subscribe, or subscribe again if the publishers have changed."""
        from composer.client.name_matching import full_name

        full_name("topic", self.topic)  # raises if it is not a valid name
        ends = [end for _, end in self._ros.observed.topology().of_topics.get(self.topic, [])]
        publishers = [end for end in ends if end.kind is PortKind.PUBLISHER]
        type_name = self._given_type or self._only_type(publishers)
        profile = self._wanted_profile(publishers, type_name)
        if self._sampled is not None and (profile, type_name) == (self._profile, self.type_name):
            return
        self.close()
        self.type_name, self._profile = type_name, profile
        self._sampled = self._ros.session.sample(self.topic, type_name, profile, raw=True)

    def _only_type(self, publishers: list[ObservedEndpoint]) -> str:
        types = sorted({end.type for end in publishers})
        if not types:
            raise RequestError("not_found", f"nothing publishes '{self.topic}' at present")
        if len(types) > 1:
            raise RequestError(
                "failed", f"'{self.topic}' has more than one type: {', '.join(types)}"
            )
        return types[0]

    def _wanted_profile(self, publishers: list[ObservedEndpoint], type_name: str) -> QosProfile:
        """Return the strictest profile that all publishers satisfy, except for large messages."""
        from composer.client.messages.topics import strictest_compatible_qos

        offers = [end.qos for end in publishers if end.qos is not None]
        profile = strictest_compatible_qos(offers, self._depth)
        return large_profile(profile) if self._is_large or type_name in LARGE_TYPES else profile
