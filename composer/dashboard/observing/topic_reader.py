"""One topic whose messages a channel shows: finds its type and QoS, and follows changes of both."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from composer.dashboard.errors import RequestError
from composer.dashboard.observing.meters import LARGE_TYPES
from composer.model import PortKind
from composer.qos import Durability, Reliability

if TYPE_CHECKING:
    from composer.dashboard.ros_side import RosGraphSide
    from composer.drift import ObservedEndpoint
    from composer.qos import QosProfile
    from composer.remote.shared_session import Sample, SampledTopic

#: Large messages that may wait for the next poll.
_LARGE_DEPTH = 5


class TopicReader:
    """Reads a topic, as bytes on request. Use it on the thread of feeds."""

    def __init__(
        self,
        ros: RosGraphSide,
        topic: str,
        type_name: str | None,
        depth: int,
        *,
        raw: bool = True,
    ) -> None:
        """Begin at the first call of :meth:`take`; without a type, it is that of the publishers."""
        self.topic = topic
        self.type_name = type_name or ""
        self.lost = 0
        self._ros = ros
        self._given_type = type_name
        self._depth = depth
        self._raw = raw
        self._sampled: SampledTopic | None = None
        self._profile: QosProfile | None = None
        self._last_number = 0

    def take(self, limit: int) -> list[Sample]:
        """Return the messages that have arrived, at most ``limit``.

        Raises RosError, RequestError if the topic has no publisher or no single, installed type.
        """
        self._subscribe()
        samples = [] if self._sampled is None else self._sampled.take(limit)
        for sample in samples:
            if 0 < self._last_number < sample.number:
                self.lost += sample.number - self._last_number - 1
            self._last_number = sample.number
        return samples

    def message(self, sample: Sample) -> object:
        """Return the message of a sample of bytes."""
        assert self._sampled is not None  # noqa: S101 - it is the source of the sample
        return self._sampled.message(sample)

    def close(self) -> None:
        """Unsubscribe."""
        if self._sampled is not None:
            self._sampled.close()
        self._sampled, self._profile = None, None

    def _subscribe(self) -> None:
        """Subscribe, or subscribe again if the publishers have changed."""
        from composer.remote.name_matching import full_name

        full_name("topic", self.topic)  # raises if it is not a valid name
        ends = [end for _, end in self._ros.observed.topology().of_topics.get(self.topic, [])]
        publishers = [end for end in ends if end.kind is PortKind.PUBLISHER]
        type_name = self._given_type or self._only_type(publishers)
        profile = self._wanted_profile(publishers, type_name)
        if self._sampled is not None and (profile, type_name) == (self._profile, self.type_name):
            return
        self.close()
        self._last_number = 0
        self.type_name, self._profile = type_name, profile
        self._sampled = self._ros.session.sample(self.topic, type_name, profile, raw=self._raw)

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
        """Return the strictest profile that all publishers satisfy.

        A stream of large messages is not requested reliably: a reader that is late would delay a
        publisher. Latched ones, such as maps, only arrive if they are.
        """
        from composer.remote.messages.topics import strictest_compatible_qos

        offers = [end.qos for end in publishers if end.qos is not None]
        profile = strictest_compatible_qos(offers, self._depth)
        if type_name in LARGE_TYPES:
            profile = replace(profile, depth=min(self._depth, _LARGE_DEPTH))
            if profile.durability is Durability.VOLATILE:
                return replace(profile, reliability=Reliability.BEST_EFFORT)
        return profile
