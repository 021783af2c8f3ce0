"""Message rates of many topics at once.

Serialized messages are taken from the subscriptions directly: with hundreds of subscriptions, an
executor spends more time on its wait set than on messages. Rates are computed from source
timestamps, so they do not depend on when messages are taken.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Self

from rclpy.subscription import Subscription

from composer.client.messages.topics import measuring_qos
from composer.client.messages.values import InvalidValueError, class_of
from composer.client.session import Session
from composer.runtime.metrics.message_rate import MessageRate
from composer.runtime.ros.qos_profiles import rclpy_profile

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
