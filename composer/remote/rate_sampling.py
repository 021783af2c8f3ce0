"""How often messages come over many topics at once.

Messages are taken from the subscriptions directly, serialized: an executor would spend more time
on finding out which of hundreds is ready than the messages take. The times are those of sending,
so that it does not matter when somebody looks.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, Self

from rclpy.node import Node
from rclpy.subscription import Subscription

from composer.remote.topics import strongest_for_all
from composer.remote.values import BadValue, class_of
from composer.runtime.ros.endpoints import topic_info
from composer.runtime.ros.qos_profiles import rclpy_profile

_DEPTH = 1000
_PAUSE_S = 0.002


class RateMeter:
    """Subscribes to topics, given with their types. Use it in a ``with`` block."""

    def __init__(self, node: Node, topics: Mapping[str, tuple[str, ...]]) -> None:
        self._node = node
        self._sent_ns: dict[str, list[int]] = {}
        self._subscriptions: dict[str, Subscription] = {}
        for topic, types in topics.items():
            subscription = self._subscribed(topic, types)
            if subscription is not None:
                self._subscriptions[topic] = subscription
                self._sent_ns[topic] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for subscription in self._subscriptions.values():
            self._node.destroy_subscription(subscription)

    def measure(self, duration_s: float) -> dict[str, float]:
        """Count for so long; return messages per second by topic, where there were two or more."""
        end_s = time.monotonic() + duration_s
        while time.monotonic() < end_s:
            for topic, subscription in self._subscriptions.items():
                self._sent_ns[topic] += _taken(subscription)
            time.sleep(_PAUSE_S)
        return {
            topic: (len(times) - 1) * 1e9 / (times[-1] - times[0])
            for topic, times in self._sent_ns.items()
            if len(times) > 1 and times[-1] > times[0]
        }

    def _subscribed(self, topic: str, types: tuple[str, ...]) -> Subscription | None:
        publishers = topic_info(self._node, topic, types).publishers
        if not publishers or len(types) != 1:
            return None
        try:
            message_type = class_of(types[0])
        except BadValue:  # not installed here: it cannot be counted
            return None
        profile = strongest_for_all([end.qos for end in publishers], _DEPTH)
        return self._node.create_subscription(
            message_type, topic, _ignore, rclpy_profile(profile), raw=True
        )


def _ignore(_: Any) -> None:
    """Stand in for the callback: messages are taken without one."""


def _taken(subscription: Subscription) -> list[int]:
    """Return when the messages that are there now were sent, in nanoseconds."""
    times = []
    with subscription.handle:
        while (found := subscription.handle.take_message(subscription.msg_type, True)) is not None:
            times.append(int(found[1]["source_timestamp"]))
    return times
