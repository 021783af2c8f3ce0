"""Publishers whose rate is known, for the checks that hold QoS against it."""

from __future__ import annotations

from collections.abc import Iterator

from composer.checks.context import Context
from composer.checks.periods import publishing_periods
from composer.model import PortKind, PortOfNode


def timed_publishers(context: Context) -> tuple[tuple[PortOfNode, float], ...]:
    """Return every publisher that timers publish through, with the shortest period in seconds."""
    return tuple(_timed_publishers(context))


def _timed_publishers(context: Context) -> Iterator[tuple[PortOfNode, float]]:
    for node in context.system.nodes:
        for name, period_s in publishing_periods(node):
            port = node.port(name)
            if port is not None and port.kind is PortKind.PUBLISHER:
                yield PortOfNode(node, port), period_s


def fastest_period_s(context: Context) -> dict[str, float]:
    """Return the shortest known period in seconds of every topic that has one, by full name."""
    periods: dict[str, float] = {}
    for end, period_s in context.once(timed_publishers):
        name = end.port.full_name
        periods[name] = min(period_s, periods.get(name, period_s))
    return periods
