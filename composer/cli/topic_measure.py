"""Measuring what comes over a topic, with a report every second."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from composer.cli.qos_options import QosWish
from composer.cli.ros import ros_session
from composer.cli.terminal import say, write

if TYPE_CHECKING:
    from composer.runtime.inspect_topics import Received

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


def measure(
    topic: str, measuring: Measuring, qos: QosWish, count: int | None, timeout_s: float
) -> None:
    """Take what comes until ``count`` messages have; print reports every second and at the end."""
    with ros_session("compose topic", timeout_s) as (session, deadline):
        from composer.runtime.inspect_topics import Listener, Topics
        from composer.runtime.session import Deadline

        topics = Topics(session, deadline)
        name = topic if topic.startswith("/") else f"/{topic}"
        type_name = topics.type_of(name)
        profile = qos.applied_to(topics.matching(name))
        seen = before = 0
        with Listener(session, name, type_name, profile, raw=measuring.raw) as listener:
            tick = Deadline(_REPORT_EVERY_S)
            while count is None or seen < count:
                wanted = [item for item in listener.take(tick) if _is_wanted(measuring, item)]
                for item in wanted[: None if count is None else count - seen]:
                    measuring.take(item)
                    seen += 1
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
