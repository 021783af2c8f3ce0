"""``compose topic hz``, ``bw`` and ``delay``: how often, how much and how late."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.commands.topic_measure import Limits, Measuring, measure
from composer.cli.support.listing import Json
from composer.cli.support.qos_options import QosWish, takes_qos_options
from composer.cli.support.values import as_json
from composer.cli.support.wanted_messages import Filter, Patience, compiled_filter, is_wanted

if TYPE_CHECKING:
    from composer.remote.rates import Bandwidth, Delay, Rate
    from composer.remote.topics import Received

_UNITS = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))

Topic = Annotated[str, typer.Argument(metavar="TOPIC")]
Window = Annotated[
    int, typer.Option("--window", "-w", min=2, metavar="N", help="Over the last N messages.")
]
Count = Annotated[
    int | None,
    typer.Option(min=2, metavar="N", help="Stop after N messages.", show_default="never"),
]


@takes_qos_options
def hz(
    topic: Topic,
    *,
    window: Window = 10_000,
    count: Count = None,
    condition: Filter = None,
    json: Json = False,
    qos: QosWish,
    timeout: Patience = None,
) -> None:
    """Print how often messages come, once a second, until Ctrl-C."""
    from composer.remote.rates import RateWindow

    rates = RateWindow(window)
    wanted = compiled_filter(condition)

    def report(_: float) -> str | None:
        rate = rates.rate()
        if rate is None:
            return None
        return as_json(asdict(rate)) if json else _rate_text(rate)

    measuring = Measuring(
        take=lambda item: rates.add(item.at_s),
        report=report,
        raw=wanted is None,
        is_wanted=None if wanted is None else lambda message: is_wanted(wanted, message),
    )
    measure(topic, measuring, qos, Limits.given(timeout, count))


@takes_qos_options
def bw(
    topic: Topic,
    *,
    window: Window = 100,
    count: Count = None,
    json: Json = False,
    qos: QosWish,
    timeout: Patience = None,
) -> None:
    """Print how much comes, once a second, until Ctrl-C. Sizes are those of serialized messages."""
    from composer.remote.rates import BandwidthWindow

    sizes = BandwidthWindow(window)

    def report(now_s: float) -> str | None:
        bandwidth = sizes.bandwidth(now_s)
        if bandwidth is None:
            return None
        return as_json(asdict(bandwidth)) if json else _bandwidth_text(bandwidth)

    measuring = Measuring(
        take=lambda item: sizes.add(item.at_s, len(item.content)), report=report, raw=True
    )
    measure(topic, measuring, qos, Limits.given(timeout, count))


@takes_qos_options
def delay(
    topic: Topic,
    *,
    window: Window = 10_000,
    count: Count = None,
    condition: Filter = None,
    json: Json = False,
    qos: QosWish,
    timeout: Patience = None,
) -> None:
    """Print how old messages are when they come, once a second, until Ctrl-C.

    That is the time since header.stamp, by this computer's clock.
    """
    from composer.remote.rates import DelayWindow

    delays = DelayWindow(window)
    wanted = compiled_filter(condition)

    def take(item: Received) -> None:
        from composer.remote.values import age_s  # imports rclpy: ROS is there by now

        delays.add(age_s(item.content, item.at_s))

    def report(_: float) -> str | None:
        found = delays.delay()
        if found is None:
            return None
        return as_json(asdict(found)) if json else _delay_text(found)

    measuring = Measuring(
        take=take,
        report=report,
        is_wanted=None if wanted is None else lambda message: is_wanted(wanted, message),
    )
    measure(topic, measuring, qos, Limits.given(timeout, count))


def _rate_text(rate: Rate) -> str:
    return (
        f"average rate: {rate.average_hz:.3f} Hz  min: {rate.shortest_s:.4f} s"
        f"  max: {rate.longest_s:.4f} s  std dev: {rate.deviation_s:.5f} s  window: {rate.window}"
    )


def _delay_text(delay: Delay) -> str:
    return (
        f"average delay: {delay.average_s:.4f} s  min: {delay.shortest_s:.4f} s"
        f"  max: {delay.longest_s:.4f} s  std dev: {delay.deviation_s:.5f} s"
        f"  window: {delay.window}"
    )


def _bandwidth_text(found: Bandwidth) -> str:
    return (
        f"{_size(found.bytes_per_s)}/s from {found.window} messages"
        f"  mean: {_size(found.mean)}  min: {_size(found.smallest)}  max: {_size(found.largest)}"
    )


def _size(size_bytes: float) -> str:
    for factor, unit in _UNITS:
        if size_bytes >= factor:
            return f"{size_bytes / factor:.2f} {unit}"
    return f"{size_bytes:.0f} B"
