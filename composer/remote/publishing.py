"""Publishing from the command line."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from rclpy.duration import Duration

from composer.qos import QosProfile
from composer.remote.graph_names import other_types
from composer.remote.session import Deadline, NoAnswer, RosError, Session
from composer.remote.values import Build, class_of
from composer.runtime.ros.qos_profiles import rclpy_profile

_ACKNOWLEDGED_WITHIN_S = 1


class NotAcknowledged(RosError):
    """A reliable subscription has not said in time that it has all that was published."""


@dataclass(frozen=True, slots=True)
class Publishing:
    """What is published how often. ``times`` None means for ever.

    ``wait_for`` is the number of subscriptions that must have matched before the first message.
    """

    topic: str
    type_name: str
    build: Build
    qos: QosProfile
    rate_hz: float = 1.0
    times: int | None = None
    wait_for: int = 0


def publish(session: Session, deadline: Deadline, what: Publishing) -> Iterator[Any]:
    """Publish and yield each message, then see that reliable subscriptions have got them.

    The deadline is for the matching; raises NoAnswer. After the last message, raises
    NotAcknowledged. Messages see ``count`` (from 0) and ``now`` (seconds).
    """
    publisher = session.node.create_publisher(
        class_of(what.type_name), what.topic, rclpy_profile(what.qos)
    )
    try:
        _wait_for_match(session, deadline, publisher.get_subscription_count, what)
        next_s = time.monotonic()
        count = 0
        while what.times is None or count < what.times:
            message = what.build({"count": count, "now": time.time()})
            publisher.publish(message)
            yield message
            count += 1
            next_s += 1.0 / what.rate_hz
            if what.times is None or count < what.times:
                _spin_until(session, next_s)
        if not publisher.wait_for_all_acked(Duration(seconds=_ACKNOWLEDGED_WITHIN_S)):
            raise _not_acknowledged(what.topic)
    finally:
        session.node.destroy_publisher(publisher)


def _wait_for_match(
    session: Session, deadline: Deadline, matched: Callable[[], int], what: Publishing
) -> None:
    if session.wait_for(lambda: matched() >= what.wait_for or None, deadline) is None:
        hint = "--wait-matching-subscriptions 0 publishes at once; compose topic info -v shows QoS"
        raise NoAnswer(
            f"{matched()} of {what.wait_for} subscriptions to '{what.topic}' were there within"
            f" {deadline.timeout_s:g} s",
            other_types(session, "topic", what.topic, what.type_name) or hint,
        )


def _not_acknowledged(topic: str) -> NotAcknowledged:
    return NotAcknowledged(
        f"not every reliable subscription to '{topic}' has acknowledged what was published within"
        f" {_ACKNOWLEDGED_WITHIN_S} s",
        "it may not have arrived: a subscriber may be stopped, busy or just gone, or the network"
        f" loses much; 'compose topic info -v {topic}' shows who is there",
    )


def _spin_until(session: Session, at_s: float) -> None:
    pause = Deadline(at_s - time.monotonic())
    while not pause.passed:
        session.spin_once(pause)
