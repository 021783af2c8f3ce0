"""Performance targets, compared with the measurements."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from benchmarks import dashboard, large_systems, live_commands, page, recording, several_processes
from benchmarks.figures import Row, aligned, ratios, spread
from benchmarks.rounds import EVENTS, SINGLE, UNTRACED

_CPU = "CPU us/message"


@dataclass(frozen=True, slots=True)
class Target:
    """The maximum median ratio of the row with this case, unit and baseline."""

    case: str
    unit: str
    baseline: str
    at_most: float


TARGETS = (
    Target("chain, String 100 Hz, N=10", _CPU, EVENTS, 1 / 3),
    Target("chain, String 100 Hz, N=100", _CPU, EVENTS, 1 / 8),
    Target("chain, Image 30 Hz, N=10", _CPU, EVENTS, 1 / 10),
    Target("ring, N=10", _CPU, SINGLE, 1 / 25),
    Target("ring, N=300", _CPU, "composer, N=10", 1.3),
    Target("hop 1000 Hz p50, N=100", "latency us", EVENTS, 1 / 15),
    Target("timer 500 Hz p50, N=100", "jitter us", EVENTS, 1.5),
    Target("external process, one processor", _CPU, EVENTS, 0.8),
    Target("service, N=10, p50", "round trip us", EVENTS, 1 / 5),
    Target("action, N=10, p50", "round trip us", EVENTS, 1 / 5),
    Target("pipeline.yaml", "CPU ms/s", "rclpy, SingleThreadedExecutor", 1 / 4),
    Target(f"start, N=300, {large_systems.COMPOSED}", "s", large_systems.HAND_WRITTEN, 1.1),
    Target(f"start, N=300, {large_systems.LEAN}", "s", large_systems.HAND_WRITTEN, 1 / 8),
    Target(f"stop, N=300, {large_systems.COMPOSED}", "s", large_systems.HAND_WRITTEN, 1 / 5),
    Target("ring, N=10", _CPU, UNTRACED, 1.1),
    Target(dashboard.IDLE, "CPU ms/s", dashboard.WITHOUT, 1.02),
    Target(dashboard.WATCHED, "CPU ms/s", dashboard.WITHOUT, 1.3),
    Target(dashboard.STALLED, "p99 us", dashboard.UNWATCHED, 1.05),
    Target(recording.PUBLISHING, _CPU, recording.SUBSCRIBER, 0.3),
    Target(recording.PUBLISHING, "p99 us", recording.WITHOUT, 1.05),
    Target(recording.REPLAY, "s", recording.MINUTE, 1.0),
    Target(several_processes.COMPUTING, "ms/result", several_processes.ONE_PROCESS, 1 / 1.7),
    Target(several_processes.LATENCY, "us/message", SINGLE, 0.8),
    Target(page.FIRST_VIEW, "wall ms", page.ONE_SECOND, 1.0),
    Target(page.IN_OPEN_WINDOW, "wall ms", page.ONE_SECOND, 1.0),
    Target(page.PANNING, "ms", page.SIXTY_HZ, 1.02),
    Target(f"{live_commands.ALL}, p99", "wall ms", live_commands.ONE_SECOND, 1.0),
)


def table(rows: Iterable[Row]) -> str:
    """Return a table of the measured targets with their ratios; empty if there are none."""
    known = {(row.case, row.unit, row.baseline): row for row in rows}
    lines = [("target", "unit", "baseline", "maximum", "measured", "min - max", "")]
    for target in TARGETS:
        row = known.get((target.case, target.unit, target.baseline))
        if row is not None:
            lines.append(_line(target, row))
    return aligned(lines, right=(3, 4, 5)) if len(lines) > 1 else ""


def _line(target: Target, row: Row) -> tuple[str, ...]:
    ratio = spread(ratios(row))
    head = (target.case, target.unit, target.baseline, f"{target.at_most:.3g}")
    if ratio is None:
        return (*head, "-", "-", "not measured")
    reached = "reached" if ratio.median <= target.at_most else "MISSED"
    return (*head, f"{ratio.median:.3g}", f"{ratio.lowest:.3g} - {ratio.highest:.3g}", reached)
