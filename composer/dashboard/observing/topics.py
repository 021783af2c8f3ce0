"""The topics of the ROS graph: their messages as bytes, and the nodes that they connect.

Messages are read for channels that show them, and to measure rates and sizes. Of large messages,
and of topics with many bytes per second, only some are read.

The topology has the nodes of the ROS graph with their endpoints, and what the views ask about them.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass
from composer.dashboard.protocol.messages import RequestError
from composer.model import PortKind
from composer.model.names import is_hidden
from composer.model.qos import Durability, QosProfile, Reliability, strictest_compatible
from composer.plan.drift import ObservedEndpoint, ObservedNode, Snapshot, is_manager
from composer.runtime.metrics.figures import MessageRate

if TYPE_CHECKING:
    from composer.client.shared_session import Sample, SampledTopic, SharedSession
    from composer.plan.drift import ObservedEndpoint


_GET_STATE = "lifecycle_msgs/srv/GetState"
#: Messages of these types are expected to be large. Another type is large once a message was.
LARGE_TYPES = frozenset(
    f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "PointCloud2", "PointCloud")
) | {"nav_msgs/msg/OccupancyGrid", "visualization_msgs/msg/MarkerArray"}
LARGE_BYTES = 100_000
#: Of one topic, for one reader. Images with 640 x 480 pixels have less at 30 Hz.
MAX_BYTES_PER_S = 30_000_000
_BURST_S = 0.3
#: Large messages that may wait.
_LARGE_DEPTH = 5
#: Messages of a measured topic that may wait, and that are taken at once.
_MEASURED_DEPTH, _MAX_MEASURED = 100, 200


@dataclass(frozen=True)
class Topology:
    """The nodes of the ROS graph with all of their endpoints. ``revision`` counts changes.

    ``counts`` has the number of nodes of each name. Nodes of commands are left out.
    """

    revision: int
    nodes: Mapping[str, tuple[ObservedEndpoint, ...]]
    counts: Mapping[str, int]

    @cached_property
    def visible(self) -> list[str]:
        """The names of nodes that are not hidden, sorted."""
        return [name for name in self.nodes if not is_hidden(name)]

    @cached_property
    def lifecycle_nodes(self) -> frozenset[str]:
        """The nodes that report their lifecycle state on request."""
        return frozenset(
            node
            for node, ends in self.nodes.items()
            if any((end.name, end.type) == (f"{node}/get_state", _GET_STATE) for end in ends)
        )

    def snapshot(self, states: Mapping[str, str | None]) -> Snapshot:
        """Return the nodes as :mod:`composer.graph` and :mod:`composer.plan.drift` read them."""
        return Snapshot(
            tuple(
                ObservedNode(
                    full_name=name,
                    endpoints=tuple(end for end in ends if not end.is_for_tools),
                    state=states.get(name, ""),
                    count=self.counts.get(name, 1),
                )
                for name, ends in self.nodes.items()
            )
        )

    @cached_property
    def of_topics(self) -> Mapping[str, list[tuple[str, ObservedEndpoint]]]:
        """The endpoints of each topic with the names of their nodes."""
        found: dict[str, list[tuple[str, ObservedEndpoint]]] = {}
        for name in self.visible:
            for end in self.nodes[name]:
                if end.kind in (PortKind.PUBLISHER, PortKind.SUBSCRIPTION):
                    found.setdefault(end.name, []).append((name, end))
        return found

    @cached_property
    def managers(self) -> frozenset[str]:
        """The managers of running systems: the page shows their reports and has their commands."""
        return frozenset(node for node, ends in self.nodes.items() if is_manager(node, ends))

    def is_for_tools(self, name: str) -> bool:
        """Return whether a topic or service is hidden by name, or is one of a manager."""
        return is_hidden(name) or name.rpartition("/")[0] in self.managers


def first_topology() -> Topology | None:
    """Return what systems on this computer know of the ROS graph, None if none is certain.

    Ask before joining it: systems are not certain while they discover another process.
    """
    from composer.client.systems.local_queries import local_endpoints
    from composer.runtime.ros.graph import COMMAND_PREFIX

    answer = local_endpoints()
    if answer is None:
        return None
    found, names = answer
    counts = Counter(
        name for name in names if not name.rpartition("/")[2].startswith(COMMAND_PREFIX)
    )
    return Topology(1, {name: found[name] for name in sorted(found) if name in counts}, counts)


def large_profile(profile: QosProfile) -> QosProfile:
    """Return a profile to read large messages.

    It is best effort, because a late reliable reader would delay the publisher. Latched messages,
    such as maps, arrive at reliable readers only, so for these it stays reliable.
    """
    few = replace(profile, depth=min(profile.depth, _LARGE_DEPTH))
    if profile.durability is Durability.VOLATILE:
        return replace(few, reliability=Reliability.BEST_EFFORT)
    return few


class ByteLimit:
    """Says when to read a topic, so that no more than so many bytes per second are read."""

    def __init__(self) -> None:
        self._left = MAX_BYTES_PER_S * _BURST_S
        self._at_s: float | None = None

    def allows(self, now_s: float) -> bool:
        """Return whether to read now, by ``time.monotonic()``."""
        passed_s = 0.0 if self._at_s is None else now_s - self._at_s
        self._at_s = now_s
        self._left = min(self._left + passed_s * MAX_BYTES_PER_S, MAX_BYTES_PER_S * _BURST_S)
        return self._left > 0.0

    def count(self, size: int) -> None:
        """Count a message that was read."""
        self._left -= size


class TopicReader:
    """Reads a topic: finds its type and QoS, and follows changes of both.

    Use it on the thread of feeds. Without a ``type_name``, the publishers say the type.
    """

    #: Whether messages from before the subscription arrive, if publishers keep them.
    latched = True

    def __init__(
        self,
        session: SharedSession,
        topology: Callable[[], Topology],
        topic: str,
        type_name: str | None,
        depth: int,
    ) -> None:
        self.topic = topic
        self.type_name = type_name or ""
        #: Before each message of the last :meth:`take`, how many were published and not read.
        #: Nothing is known about topics with several publishers: each has numbers of its own.
        self.missed: list[int] = []
        self._session = session
        self._topology = topology
        self._given_type = type_name
        self._depth = depth
        self._limit = ByteLimit()
        self._is_large = False
        self._sampled: SampledTopic | None = None
        self._profile: QosProfile | None = None
        self._has_one_publisher = False
        self._last_number = 0

    @property
    def is_subscribed(self) -> bool:
        """Whether the topic is read at present."""
        return self._sampled is not None

    @property
    def depth(self) -> int:
        """How many messages may wait; after as many, others may have been dropped here."""
        return self._depth if self._profile is None else self._profile.depth

    def take(self, limit: int) -> list[Sample]:
        """Return the messages that have arrived, at most ``limit``.

        Raises RosError, RequestError if the topic has no publisher or no single, installed type.
        """
        self.missed = []
        self._subscribe()
        if self._sampled is None or not self._limit.allows(time.monotonic()):
            return []  # what waits too long is dropped by DDS, without being copied
        samples = self._sampled.take(limit)
        for sample in samples:
            size = len(sample.content)
            self._limit.count(size)
            self._is_large = self._is_large or size >= LARGE_BYTES
            is_known = self._has_one_publisher and 0 < self._last_number < sample.number
            self.missed.append(sample.number - self._last_number - 1 if is_known else 0)
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
        self._sampled, self._profile, self._last_number = None, None, 0

    def _subscribe(self) -> None:
        """Subscribe, or subscribe again if the publishers have changed."""
        from composer.client.graph_names import full_name

        full_name("topic", self.topic)  # raises if it is not a valid name
        ends = self._topology().of_topics.get(self.topic, [])
        publishers = [end for _, end in ends if end.kind is PortKind.PUBLISHER]
        self._has_one_publisher = len(publishers) == 1
        type_name = self._given_type or self._only_type(publishers)
        profile = self._wanted_profile(publishers, type_name)
        if self._sampled is not None and (profile, type_name) == (self._profile, self.type_name):
            return
        self.close()
        self.type_name, self._profile = type_name, profile
        self._sampled = self._session.sample(self.topic, type_name, profile, raw=True)

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
        from composer.client.messages.topics import measuring_qos

        offers = [end.qos for end in publishers if end.qos is not None]
        strictest = strictest_compatible if self.latched else measuring_qos
        profile = strictest(offers, self._depth)
        return large_profile(profile) if self._is_large or type_name in LARGE_TYPES else profile


@dataclass(frozen=True, slots=True)
class TopicFigures:
    """What was measured of a topic; None where it is not known yet.

    ``lost`` counts messages that did not arrive, without those that waited here for too long.
    """

    rate_hz: float | None = None
    bytes_per_s: float | None = None
    mean_bytes: float | None = None
    age_s: float | None = None
    messages: int = 0
    lost: int = 0


@dataclass(slots=True)
class _Meter:
    reader: TopicReader
    rate: MessageRate = field(default_factory=MessageRate)
    users: int = 0
    messages: int = 0
    lost: int = 0
    #: The graph in which the topic cannot be read: that is tried again in the next one.
    unreadable_in: Topology | None = field(default=None, repr=False)


class TopicMeters:
    """Measures topics while anything shows them. Use it on the thread of feeds.

    Messages are not deserialized. Sequence numbers show how many were published in between, so the
    rate is right although a fast topic is not read completely.
    """

    def __init__(self, session: SharedSession, topology: Callable[[], Topology]) -> None:
        self._session = session
        self._topology = topology
        self._meters: dict[str, _Meter] = {}

    def acquire(self, topics: Iterable[str]) -> None:
        """Measure topics, as soon as they have a publisher and a single, installed type."""
        for topic in topics:
            if topic not in self._meters:
                reader = TopicReader(self._session, self._topology, topic, None, _MEASURED_DEPTH)
                reader.latched = False
                self._meters[topic] = _Meter(reader)
            self._meters[topic].users += 1

    def release(self, topics: Iterable[str]) -> None:
        """Stop measuring topics once every user has released them."""
        for topic in topics:
            meter = self._meters[topic]
            meter.users -= 1
            if not meter.users:
                meter.reader.close()
                del self._meters[topic]

    def poll(self) -> None:
        """Take the messages that have arrived."""
        topology = self._topology()
        for meter in self._meters.values():
            if meter.unreadable_in is not topology:
                _measure(meter, topology)

    def figures(self, topic: str) -> TopicFigures | None:
        """Return the figures of a topic, None if it is not measured."""
        meter = self._meters.get(topic)
        if meter is None or not meter.reader.is_subscribed:
            return None
        return _figures(meter, time.time())

    def close(self) -> None:
        """Stop measuring."""
        for meter in self._meters.values():
            meter.reader.close()
        self._meters.clear()


def _measure(meter: _Meter, topology: Topology) -> None:
    from composer.client.session import RosError

    try:
        samples = meter.reader.take(_MAX_MEASURED)
    except (RequestError, RosError):
        meter.unreadable_in = topology
        return
    is_complete = len(samples) < meter.reader.depth
    for sample, missed in zip(samples, meter.reader.missed, strict=True):
        meter.lost += missed * is_complete
        meter.messages += 1
        meter.rate.add(sample.at_s, len(sample.content), missed)


def _figures(meter: _Meter, now_s: float) -> TopicFigures:
    rate = meter.rate
    rate_hz, mean_bytes = rate.current_hz(now_s), rate.mean_bytes
    if mean_bytes is None:
        return TopicFigures()
    return TopicFigures(
        rate_hz=rate_hz,
        bytes_per_s=None if rate_hz is None else rate_hz * mean_bytes,
        mean_bytes=mean_bytes,
        age_s=max(0.0, now_s - rate.last_s),
        messages=meter.messages,
        lost=meter.lost,
    )
