"""Measuring what comes over a topic, with a report every second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.cli.support.qos_options import QosWish
from composer.cli.support.ros import ros_session
from composer.cli.support.terminal import say, write
from composer.cli.support.wanted_messages import message_timeout_s, topic_timeout_s

if TYPE_CHECKING:
    from composer.remote.topics import Received

_REPORT_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class Measuring:
    """What is done with what comes.

    ``report`` is given the time (seconds, time.monotonic) and returns nothing while there is
    nothing to tell; ``raw`` asks for serialized bytes, which take no time to read; messages that
    are not wanted do not count.
    """

    take: Callable[[Received], None]
    report: Callable[[float], str | None]
    raw: bool = False
    is_wanted: Callable[[Any], bool] | None = None


@dataclass(frozen=True, slots=True)
class Limits:
    """When measuring ends: after ``count`` messages, or when one is waited for for too long."""

    topic_timeout_s: float
    message_timeout_s: float
    count: int

    @classmethod
    def given(cls, timeout: float | None, count: int | None) -> Limits:
        """Return the limits of the options; what is not given never ends anything."""
        return cls(
            topic_timeout_s(timeout),
            message_timeout_s(timeout),
            sys.maxsize if count is None else count,
        )


def measure(topic: str, measuring: Measuring, qos: QosWish, limits: Limits) -> None:
    """Take what comes up to the limits; print reports every second and at the end."""
    with ros_session("compose topic", limits.topic_timeout_s, carries_messages=True) as (
        session,
        deadline,
    ):
        from composer.remote.name_matching import full_name
        from composer.remote.session import Deadline, NoAnswer
        from composer.remote.topics import Listener, Topics

        topics = Topics(session, deadline)
        name = full_name("topic", topic)
        type_name = topics.type_of(name)
        profile = qos.applied_to(topics.matching(name))
        seen = before = 0
        with Listener(session, name, type_name, profile, raw=measuring.raw) as listener:
            tick, patience = Deadline(_REPORT_EVERY_S), Deadline(limits.message_timeout_s)
            while seen < limits.count:
                next_s = Deadline(min(tick.left_s, patience.left_s))
                wanted = [item for item in listener.take(next_s) if _is_wanted(measuring, item)]
                for item in wanted[: limits.count - seen]:
                    measuring.take(item)
                    seen += 1
                if wanted:
                    patience = Deadline(limits.message_timeout_s)
                elif patience.passed:
                    raise NoAnswer(f"nothing came over '{name}' for {limits.message_timeout_s:g} s")
                if tick.passed:
                    _tell(measuring.report(time.monotonic()) if seen > before else None, name)
                    before, tick = seen, Deadline(_REPORT_EVERY_S)
        if seen > before:
            _tell(measuring.report(time.monotonic()), name)


def _is_wanted(measuring: Measuring, item: Received) -> bool:
    return measuring.is_wanted is None or measuring.is_wanted(item.content)


def _tell(text: str | None, topic: str) -> None:
    if text is None:
        say(f"no new messages over '{topic}'")
    else:
        write(text)
