"""Rates of the messages of a topic, over a window of the last ones."""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Mapping
from contextlib import ExitStack
from itertools import pairwise

from composer.base.fast_dataclass import dataclass
from composer.client.messages.topics import measuring_qos
from composer.client.messages.values import InvalidValueError
from composer.client.session import Session
from composer.client.shared_session import SampledTopic
from composer.runtime.metrics.message_rate import MessageRate


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
#: A message has its time already, so it may wait: polling costs less than a wake-up for each.
_POLL_PERIOD_S = 0.002


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
                for sample in samples.take(_DEPTH):
                    rates[topic].add(sample.at_s)
            time.sleep(_POLL_PERIOD_S)
    known = {topic: rate.hertz for topic, rate in rates.items()}
    return {topic: hertz for topic, hertz in known.items() if hertz is not None}


def _sample(session: Session, topic: str, types: tuple[str, ...]) -> SampledTopic | None:
    publishers = session.graph.topic(topic, types).publishers
    if not publishers or len(types) != 1:
        return None
    qos = measuring_qos([publisher.qos for publisher in publishers], _DEPTH)
    try:
        return SampledTopic(session.node, topic, types[0], qos, raw=True)
    except InvalidValueError:  # not installed, so it cannot be counted
        return None
