"""``compose topic hz`` and ``compose topic bw``: how often and how much."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from composer.cli.listing import Json
from composer.cli.ros import DEFAULT_TIMEOUT_S, Timeout, ros_session
from composer.cli.terminal import say, write
from composer.cli.values import as_json

if TYPE_CHECKING:
    from composer.runtime.inspect_rates import Bandwidth, Rate
    from composer.runtime.inspect_topics import Received

_REPORT_EVERY_S = 1.0
_UNITS = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))

Topic = Annotated[str, typer.Argument(metavar="TOPIC")]
Window = Annotated[
    int, typer.Option("--window", "-w", min=2, metavar="N", help="Over the last N messages.")
]
Count = Annotated[
    int | None,
    typer.Option(min=2, metavar="N", help="Stop after N messages.", show_default="never"),
]


def hz(
    topic: Topic,
    *,
    window: Window = 10_000,
    count: Count = None,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print how often messages come, once a second, until Ctrl-C."""
    from composer.runtime.inspect_rates import RateWindow

    rates = RateWindow(window)

    def report(_: float) -> str | None:
        rate = rates.rate()
        if rate is None:
            return None
        return as_json(asdict(rate)) if json else _rate_text(rate)

    _measure(topic, timeout, count, lambda item: rates.add(item.at_s), report)


def bw(
    topic: Topic,
    *,
    window: Window = 100,
    count: Count = None,
    json: Json = False,
    timeout: Timeout = DEFAULT_TIMEOUT_S,
) -> None:
    """Print how much comes, once a second, until Ctrl-C. Sizes are those of serialized messages."""
    from composer.runtime.inspect_rates import BandwidthWindow

    sizes = BandwidthWindow(window)

    def report(now_s: float) -> str | None:
        bandwidth = sizes.bandwidth(now_s)
        if bandwidth is None:
            return None
        return as_json(asdict(bandwidth)) if json else _bandwidth_text(bandwidth)

    _measure(topic, timeout, count, lambda item: sizes.add(item.at_s, len(item.content)), report)


def _measure(
    topic: str,
    timeout: float,
    count: int | None,
    take: Callable[[Received], None],
    report: Callable[[float], str | None],
) -> None:
    """Feed what comes to ``take`` and print what ``report`` says, every second and at the end."""
    with ros_session("compose topic", timeout) as (session, deadline):
        from composer.runtime.inspect_topics import Listener, Topics
        from composer.runtime.session import Deadline

        topics = Topics(session, deadline)
        name = topic if topic.startswith("/") else f"/{topic}"
        type_name = topics.type_of(name)
        seen = 0
        with Listener(session, name, type_name, topics.matching(name), raw=True) as listener:
            tick = Deadline(_REPORT_EVERY_S)
            before = 0
            while count is None or seen < count:
                for item in listener.take(tick)[: None if count is None else count - seen]:
                    take(item)
                    seen += 1
                if tick.passed:
                    _tell(report(time.monotonic()) if seen > before else None, name)
                    before, tick = seen, Deadline(_REPORT_EVERY_S)
        if seen > before:
            _tell(report(time.monotonic()), name)


def _tell(text: str | None, topic: str) -> None:
    if text is None:
        say(f"no new messages over '{topic}'")
    else:
        write(text)


def _rate_text(rate: Rate) -> str:
    return (
        f"average rate: {rate.average_hz:.3f} Hz  min: {rate.shortest_s:.4f} s"
        f"  max: {rate.longest_s:.4f} s  std dev: {rate.deviation_s:.5f} s  window: {rate.window}"
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
