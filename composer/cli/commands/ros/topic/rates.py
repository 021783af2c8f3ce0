"""``compose topic hz``, ``bw`` and ``delay``: measure a topic and report every second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from composer.base.fast_dataclass import dataclass
from composer.cli.commands.ros.topic.qos_options import QosOptions, qos_options
from composer.cli.commands.ros.topic.receiving import (
    Filter,
    MessageFilter,
    ReceiveTimeout,
    Topic,
    message_timeout_s,
    topic_timeout_s,
)
from composer.cli.support.options import Json
from composer.cli.support.output.results import as_json
from composer.cli.support.output.terminal import say, write
from composer.cli.support.ros import ros_session

if TYPE_CHECKING:
    from composer.client.messages.rates import BandwidthStatistics, DelayStatistics, RateStatistics
    from composer.client.messages.topics import Received

_REPORT_EVERY_S = 1.0
_UNITS = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))

Window = Annotated[
    int, typer.Option("--window", "-w", min=2, metavar="N", help="Use the last N messages.")
]
MessageCount = Annotated[
    int | None,
    typer.Option(min=2, metavar="N", help="Exit after N messages.", show_default="no limit"),
]


@qos_options
def hz(
    topic: Topic,
    *,
    window: Window = 10_000,
    count: MessageCount = None,
    condition: Filter = None,
    json: Json = False,
    qos: QosOptions,
    timeout: ReceiveTimeout = None,
) -> None:
    """Print the average rate of a topic every second."""
    from composer.client.messages.rates import RateWindow

    rates = RateWindow(window)
    message_filter = MessageFilter(condition)

    def report(_: float) -> str | None:
        rate = rates.statistics()
        if rate is None:
            return None
        return as_json(asdict(rate)) if json else _rate_text(rate)

    measurement = _Measurement(
        add=lambda item: rates.add(item.at_s),
        report=report,
        message_filter=message_filter,
        raw=message_filter.passes_all,
    )
    _measure(topic, measurement, qos, _Limits.from_options(timeout, count))


@qos_options
def bw(
    topic: Topic,
    *,
    window: Window = 100,
    count: MessageCount = None,
    json: Json = False,
    qos: QosOptions,
    timeout: ReceiveTimeout = None,
) -> None:
    """Print the bandwidth of a topic every second.

    Sizes are those of serialized messages.
    """
    from composer.client.messages.rates import BandwidthWindow

    sizes = BandwidthWindow(window)

    def report(now_s: float) -> str | None:
        bandwidth = sizes.statistics(now_s)
        if bandwidth is None:
            return None
        return as_json(asdict(bandwidth)) if json else _bandwidth_text(bandwidth)

    measurement = _Measurement(
        add=lambda item: sizes.add(item.at_s, len(item.content)),
        report=report,
        message_filter=MessageFilter(None),
        raw=True,
    )
    _measure(topic, measurement, qos, _Limits.from_options(timeout, count))


@qos_options
def delay(
    topic: Topic,
    *,
    window: Window = 10_000,
    count: MessageCount = None,
    condition: Filter = None,
    json: Json = False,
    qos: QosOptions,
    timeout: ReceiveTimeout = None,
) -> None:
    """Print the delay of a topic's messages every second.

    The delay is the time between header.stamp and reception, by the clock of this computer.
    """
    from composer.client.messages.rates import DelayWindow

    delays = DelayWindow(window)

    def add(item: Received) -> None:
        from composer.client.messages.values import age_s  # imports rclpy, which is available here

        delays.add(age_s(item.content, item.at_s))

    def report(_: float) -> str | None:
        found = delays.statistics()
        if found is None:
            return None
        return as_json(asdict(found)) if json else _delay_text(found)

    measurement = _Measurement(add=add, report=report, message_filter=MessageFilter(condition))
    _measure(topic, measurement, qos, _Limits.from_options(timeout, count))


@dataclass(frozen=True, slots=True)
class _Measurement:
    """What to do with each message, and the report.

    ``report`` takes the time (seconds, time.monotonic) and returns None without enough messages.
    With ``raw``, messages are serialized bytes, which saves the time to deserialize them. Only
    messages that pass the filter count.
    """

    add: Callable[[Received], None]
    report: Callable[[float], str | None]
    message_filter: MessageFilter
    raw: bool = False


@dataclass(frozen=True, slots=True)
class _Limits:
    """When a measurement ends: after ``count`` messages, or if a wait times out."""

    topic_timeout_s: float
    message_timeout_s: float
    count: int

    @classmethod
    def from_options(cls, timeout: float | None, count: int | None) -> _Limits:
        """Return the limits that the options set."""
        return cls(
            topic_timeout_s(timeout),
            message_timeout_s(timeout),
            sys.maxsize if count is None else count,
        )


def _measure(topic: str, measurement: _Measurement, qos: QosOptions, limits: _Limits) -> None:
    """Receive messages up to the limits; print reports every second and at the end."""
    with ros_session("compose topic", limits.topic_timeout_s, carries_messages=True) as (
        session,
        deadline,
    ):
        from composer.client.messages.topics import Topics, TopicSubscription
        from composer.client.name_matching import full_name
        from composer.client.session import Deadline, NoResponseError

        topics = Topics(session, deadline)
        name = full_name("topic", topic)
        type_name = topics.type_of(name)
        profile = qos.applied_to(topics.measuring_qos(name))
        received = reported = 0
        with TopicSubscription(
            session, name, type_name, profile, raw=measurement.raw
        ) as subscription:
            next_report = Deadline(_REPORT_EVERY_S)
            next_message = Deadline(limits.message_timeout_s)
            while received < limits.count:
                wait = Deadline(min(next_report.left_s, next_message.left_s))
                items = [
                    item
                    for item in subscription.take(wait)
                    if measurement.message_filter.matches(item.content)
                ]
                for item in items[: limits.count - received]:
                    measurement.add(item)
                    received += 1
                if items:
                    next_message = Deadline(limits.message_timeout_s)
                elif next_message.passed:
                    raise NoResponseError(
                        f"no message received on '{name}' for {limits.message_timeout_s:g} s"
                    )
                if next_report.passed:
                    if received > reported:
                        _print_report(measurement, name)
                    else:
                        say(f"no new messages on '{name}'")
                    reported, next_report = received, Deadline(_REPORT_EVERY_S)
        if received > reported:
            _print_report(measurement, name)


def _print_report(measurement: _Measurement, topic: str) -> None:
    text = measurement.report(time.monotonic())
    if text is None:
        say(f"too few messages on '{topic}' to measure them yet")
    else:
        write(text)


def _rate_text(rate: RateStatistics) -> str:
    return (
        f"average rate: {rate.average_hz:.3f} Hz  min: {rate.shortest_s:.4f} s"
        f"  max: {rate.longest_s:.4f} s  std dev: {rate.deviation_s:.5f} s  window: {rate.window}"
    )


def _delay_text(delay: DelayStatistics) -> str:
    return (
        f"average delay: {delay.average_s:.4f} s  min: {delay.shortest_s:.4f} s"
        f"  max: {delay.longest_s:.4f} s  std dev: {delay.deviation_s:.5f} s"
        f"  window: {delay.window}"
    )


def _bandwidth_text(found: BandwidthStatistics) -> str:
    return (
        f"{_size(found.bytes_per_s)}/s from {found.window} messages"
        f"  mean: {_size(found.mean)}  min: {_size(found.smallest)}  max: {_size(found.largest)}"
    )


def _size(size_bytes: float) -> str:
    for factor, unit in _UNITS:
        if size_bytes >= factor:
            return f"{size_bytes / factor:.2f} {unit}"
    return f"{size_bytes:.0f} B"
