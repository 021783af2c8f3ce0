"""Topics of any ROS graph: their endpoints, their messages and rates, and publishing."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import replace
from itertools import pairwise
from typing import Any

from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message, serialize_message

from composer.base.fast_dataclass import dataclass
from composer.client.graph_names import full_name, type_mismatch_hint
from composer.client.messages.values import Build, InvalidValueError, class_of
from composer.client.requests import ServiceCaller
from composer.client.session import Deadline, NoResponseError, RosError, Session
from composer.client.shared_session import Sample, SampledTopic
from composer.model.qos import Durability, QosProfile, strictest_compatible
from composer.runtime.metrics.figures import MessageRate
from composer.runtime.ros.conversions import rclpy_profile
from composer.runtime.ros.endpoints import topic_info

SUBSCRIPTION_DEPTH = 1000
#: Messages that a command takes at once: they may be large.
_MAX_TAKEN = 20
_ACKNOWLEDGED_WITHIN_S = 1
#: A message has its time already, so it may wait: polling costs less than a wake-up for each.
_POLL_PERIOD_S = 0.01


class NotAcknowledgedError(RosError):
    """A reliable subscription has not acknowledged all messages in time."""


@dataclass(frozen=True, slots=True)
class Publication:
    """What to publish and how often; ``times`` None means forever.

    ``wait_for`` is the number of subscriptions to wait for before the first message.
    """

    topic: str
    type_name: str
    build: Build
    qos: QosProfile
    rate_hz: float = 1.0
    times: int | None = None
    wait_for: int = 0


class TopicSubscription(SampledTopic):
    """A subscription of a command."""

    def __init__(
        self, session: Session, topic: str, type_name: str, qos: QosProfile, *, raw: bool = False
    ) -> None:
        super().__init__(session.node, topic, type_name, qos, raw=raw)
        self.topic = topic
        self._session = session
        self._type_name = type_name

    def no_message_error(self, timeout_s: float) -> NoResponseError:
        """Return the error for a topic without messages, with the reason if it is known."""
        hint = type_mismatch_hint(self._session, "topic", self.topic, self._type_name)
        return NoResponseError(f"no message received on '{self.topic}' for {timeout_s:g} s", hint)

    def wait(self, deadline: Deadline) -> list[Sample]:
        """Return the messages that have arrived; wait for the first one until the deadline."""
        while not (samples := self.take(_MAX_TAKEN)) and not deadline.passed:
            time.sleep(min(_POLL_PERIOD_S, deadline.left_s))  # no callback: messages are taken
        return samples


def offered_profiles(session: Session, topic: str) -> list[QosProfile]:
    """Return the QoS profiles of the publishers of a topic, by its full name."""
    return [publisher.qos for publisher in topic_info(session.graph.node, topic, ()).publishers]


def measuring_qos(offers: list[QosProfile], depth: int) -> QosProfile:
    """Return the strictest compatible profile for measurements: latched messages do not arrive.

    They would arrive at once, whenever they were published.
    """
    return replace(strictest_compatible(offers, depth), durability=Durability.VOLATILE)


def publish(session: Session, deadline: Deadline, publication: Publication) -> Iterator[Any]:
    """Publish and yield each message, then wait for reliable subscriptions to acknowledge them.

    The deadline is for the subscriptions; raises NoResponseError. Raises NotAcknowledgedError after
    the last message. Expressions in messages see ``count`` (from 0) and ``now`` (seconds).
    """
    topic, type_name = publication.topic, publication.type_name
    with closing(TopicPublisher(session, topic, type_name, publication.qos)) as publisher:
        _wait_for_subscriptions(session, deadline, publisher, publication)
        next_s = time.monotonic()
        count = 0
        while publication.times is None or count < publication.times:
            message = publication.build({"count": count, "now": time.time()})
            publisher.publish(message)
            yield message
            count += 1
            next_s += 1.0 / publication.rate_hz
            if publication.times is None or count < publication.times:
                session.spin_until(next_s)
        if not publisher.wait_until_acknowledged():
            raise _not_acknowledged_error(topic)


def _wait_for_subscriptions(
    session: Session, deadline: Deadline, publisher: TopicPublisher, publication: Publication
) -> None:
    wanted = publication.wait_for
    if not session.wait_for(lambda: publisher.subscriptions >= wanted, deadline):
        hint = (
            "use --wait-matching-subscriptions 0 to publish at once; 'compose topic info -v' shows"
            " QoS profiles"
        )
        raise NoResponseError(
            f"found {publisher.subscriptions} of {wanted} subscriptions to"
            f" '{publication.topic}' within {deadline.timeout_s:g} s",
            type_mismatch_hint(session, "topic", publication.topic, publication.type_name) or hint,
        )


def _not_acknowledged_error(topic: str) -> NotAcknowledgedError:
    return NotAcknowledgedError(
        f"not every reliable subscription to '{topic}' acknowledged all messages within"
        f" {_ACKNOWLEDGED_WITHIN_S} s",
        "messages may be lost: a subscriber may be stopped, busy or gone, or the network may drop"
        f" packets; 'compose topic info -v {topic}' lists the subscriptions",
    )


class TopicPublisher:
    """A publisher of any topic."""

    def __init__(self, session: Session, topic: str, type_name: str, qos: QosProfile) -> None:
        """Raise InvalidValueError or InvalidNameError for a type or a name that is not valid."""
        self._session = session
        self._class = class_of(type_name)
        self._type_name = type_name
        self._publisher: Publisher = session.node.create_publisher(
            self._class, full_name("topic", topic), rclpy_profile(qos)
        )

    @property
    def subscriptions(self) -> int:
        """The number of subscriptions that receive the messages."""
        return int(self._publisher.get_subscription_count())

    def publish(self, message: Any) -> None:
        """Publish a message, or its serialized bytes."""
        self._publisher.publish(message)

    def publish_checked(self, data: bytes) -> None:
        """Publish bytes that are a message of the type. Raises InvalidValueError for others."""
        self._publisher.publish(_message(data, self._class, self._type_name))

    def wait_until_acknowledged(self) -> bool:
        """Wait a second at most; return whether all reliable subscriptions have all messages."""
        return self._publisher.wait_for_all_acked(Duration(seconds=_ACKNOWLEDGED_WITHIN_S))

    def close(self) -> None:
        """Destroy the publisher."""
        self._session.node.destroy_publisher(self._publisher)


def call_serialized(
    session: Session, deadline: Deadline, service: str, type_name: str, request: bytes
) -> bytes:
    """Return the response of a service. Raises InvalidValueError, NoResponseError."""
    service_class = class_of(type_name, "service")
    message = _message(request, service_class.Request, f"{type_name}_Request")
    with closing(ServiceCaller(session)) as caller:
        response = caller.call_once(service_class, service, message, deadline)
    return bytes(serialize_message(response))


def _message(data: bytes, message_class: Any, type_name: str) -> Any:
    """Return a message. Raises InvalidValueError."""
    if not message_class.get_fields_and_field_types():
        return message_class()  # programs disagree about the bytes of a message without fields
    try:
        return deserialize_message(data, message_class)
    except Exception as error:  # classes of the RMW implementation, which are not public
        raise InvalidValueError(f"{len(data)} bytes are not a message {type_name}") from error


@dataclass(frozen=True, slots=True)
class RateStatistics:
    """A message rate. Periods are in seconds; ``window`` is the number of periods."""

    average_hz: float
    shortest_s: float
    longest_s: float
    deviation_s: float
    window: int


class RateWindow:
    """The arrival times of the last ``size`` messages, and the rate of as many in whole bursts."""

    def __init__(self, size: int) -> None:
        self._size = size
        self._times_s: deque[float] = deque(maxlen=size + 1)
        self._rate = MessageRate()

    def add(self, at_s: float) -> None:
        """Add the arrival time of a message, in seconds."""
        self._times_s.append(at_s)
        self._rate.add(at_s)

    def statistics(self) -> RateStatistics | None:
        """Return the rate, None before the second burst of messages."""
        self._rate.forget_beyond(self._size)
        average_hz = self._rate.hertz
        if average_hz is None:
            return None
        periods = [later - earlier for earlier, later in pairwise(self._times_s)]
        return RateStatistics(
            average_hz=average_hz,
            shortest_s=min(periods),
            longest_s=max(periods),
            deviation_s=statistics.pstdev(periods),
            window=len(periods),
        )


def measure_rates(
    session: Session, topics: Mapping[str, tuple[str, ...]], duration_s: float
) -> dict[str, float]:
    """Return messages per second by topic, for topics with at least two bursts of messages.

    ``topics`` are names with their types.
    """
    found = {topic: _sample(session, topic, types) for topic, types in topics.items()}
    sampled = {topic: samples for topic, samples in found.items() if samples is not None}
    rates = {topic: MessageRate() for topic in sampled}
    with ExitStack() as stack:
        for samples in sampled.values():
            stack.callback(samples.close)
        end_s = time.monotonic() + duration_s
        while time.monotonic() < end_s:
            for topic, samples in sampled.items():
                for sample in samples.take(SUBSCRIPTION_DEPTH):
                    rates[topic].add(sample.at_s)
            time.sleep(_POLL_PERIOD_S)
    known = {topic: rate.hertz for topic, rate in rates.items()}
    return {topic: hertz for topic, hertz in known.items() if hertz is not None}


def _sample(session: Session, topic: str, types: tuple[str, ...]) -> SampledTopic | None:
    offers = offered_profiles(session, topic)
    if not offers or len(types) != 1:
        return None
    qos = measuring_qos(offers, SUBSCRIPTION_DEPTH)
    try:
        return SampledTopic(session.node, topic, types[0], qos, raw=True)
    except InvalidValueError:  # not installed, so it cannot be counted
        return None
