"""Rates of the messages of a topic, over a window of the last ones."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Self

from rclpy.subscription import Subscription

from composer.base.fast_dataclass import dataclass
from composer.client.messages.topics import measuring_qos
from composer.client.messages.values import InvalidValueError, class_of
from composer.client.session import Session
from composer.runtime.metrics.message_rate import MessageRate
from composer.runtime.ros.qos_profiles import rclpy_profile


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


_DEPTH = 1000
_POLL_PERIOD_S = 0.002


class RateMeter:
    """Subscribes to topics, given by name with their types. Use it in a ``with`` block."""

    def __init__(self, session: Session, topics: Mapping[str, tuple[str, ...]]) -> None:
        self._graph = session.graph
        self._node = session.node
        self._rates: dict[str, MessageRate] = {}
        self._subscriptions: dict[str, Subscription] = {}
        for topic, types in topics.items():
            subscription = self._subscribe(topic, types)
            if subscription is not None:
                self._subscriptions[topic] = subscription
                self._rates[topic] = MessageRate()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for subscription in self._subscriptions.values():
            self._node.destroy_subscription(subscription)

    def measure(self, duration_s: float) -> dict[str, float]:
        """Return messages per second by topic, for topics with at least two bursts of messages."""
        end_s = time.monotonic() + duration_s
        while time.monotonic() < end_s:
            for topic, subscription in self._subscriptions.items():
                for at_s in _take_timestamps(subscription):
                    self._rates[topic].add(at_s)
            time.sleep(_POLL_PERIOD_S)
        rates = {topic: rate.hertz for topic, rate in self._rates.items()}
        return {topic: hertz for topic, hertz in rates.items() if hertz is not None}

    def _subscribe(self, topic: str, types: tuple[str, ...]) -> Subscription | None:
        publishers = self._graph.topic(topic, types).publishers
        if not publishers or len(types) != 1:
            return None
        try:
            message_type = class_of(types[0])
        except InvalidValueError:  # not installed, so it cannot be counted
            return None
        profile = measuring_qos([publisher.qos for publisher in publishers], _DEPTH)
        return self._node.create_subscription(
            message_type, topic, _ignore, rclpy_profile(profile), raw=True
        )


def _ignore(_: Any) -> None:
    """Serve as a callback that is never called."""


def _take_timestamps(subscription: Subscription) -> list[float]:
    """Take all messages; return their source timestamps in seconds."""
    times = []
    with subscription.handle:
        while (found := subscription.handle.take_message(subscription.msg_type, True)) is not None:
            times.append(int(found[1]["source_timestamp"]) / 1e9)
    return times
