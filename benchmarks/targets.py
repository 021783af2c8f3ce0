"""What the composer is to reach, held against what was measured."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from benchmarks import answers, large_systems
from benchmarks.figures import Row, aligned, ratios, spread
from benchmarks.turns import EVENTS, SINGLE, UNTRACED

_CPU = "CPU us/message"


@dataclass(frozen=True, slots=True)
class Target:
    """The most that the median ratio of a row may be. ``case`` and the others name the row."""

    case: str
    unit: str
    against: str
    at_most: float


TARGETS = (
    Target("chain, String 100 Hz, N=10", _CPU, EVENTS, 1 / 3),
    Target("chain, String 100 Hz, N=100", _CPU, EVENTS, 1 / 8),
    Target("chain, Image 30 Hz, N=10", _CPU, EVENTS, 1 / 10),
    Target("ring, N=10", _CPU, SINGLE, 1 / 25),
    Target("ring, N=300", _CPU, "the composer, N=10", 1.3),
    Target("hop 1000 Hz p50, N=100", "latency us", EVENTS, 1 / 15),
    Target("timer 500 Hz p50, N=100", "jitter us", EVENTS, 1.5),
    Target("DDS to another process, one processor", _CPU, EVENTS, 0.8),
    Target("service, N=10, p50", "round trip us", EVENTS, 1 / 5),
    Target("pipeline.yaml", "CPU ms/s", "rclpy, SingleThreadedExecutor", 1 / 4),
    Target(f"start, N=300, {large_systems.COMPOSED}", "s", large_systems.BY_HAND, 1.1),
    Target(f"start, N=300, {large_systems.LEAN}", "s", large_systems.BY_HAND, 1 / 8),
    Target(f"stop, N=300, {large_systems.COMPOSED}", "s", large_systems.BY_HAND, 1 / 5),
    Target("ring, N=10", _CPU, UNTRACED, 1.1),
    Target(f"{answers.ALL}, p99", "wall ms", answers.A_SECOND, 1.0),
)


def table(rows: Iterable[Row]) -> str:
    """Return the targets that were measured, each with its ratio; empty when none was."""
    known = {(row.case, row.unit, row.against): row for row in rows}
    lines = [("target", "unit", "against", "at most", "measured", "least - most", "")]
    for target in TARGETS:
        row = known.get((target.case, target.unit, target.against))
        if row is not None:
            lines.append(_line(target, row))
    return aligned(lines, right=(3, 4, 5)) if len(lines) > 1 else ""


def _line(target: Target, row: Row) -> tuple[str, ...]:
    ratio = spread(ratios(row))
    head = (target.case, target.unit, target.against, f"{target.at_most:.3g}")
    if ratio is None:
        return (*head, "-", "-", "not measured")
    reached = "reached" if ratio.median <= target.at_most else "MISSED"
    return (*head, f"{ratio.median:.3g}", f"{ratio.lowest:.3g} - {ratio.highest:.3g}", reached)
