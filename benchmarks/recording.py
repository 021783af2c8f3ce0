"""Cost of recording a system from inside, and the speed of a replay into a system."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.figures import Row
from benchmarks.processes import ROOT, run_program, wall_time_s

PUBLISHING, SUBSCRIBER, WITHOUT = "recording, 1000 Hz", "a subscriber that records", "without"
REPLAY = "replay into pipeline.yaml, an hour at 100 Hz"
MINUTE = "a minute"
_TIMEOUT_S = 300.0


def measure(*, long: bool) -> list[Row]:
    """Measure both. Raises ProgramFailed."""
    rounds, pairs = (10, 20) if long else (3, 10)
    ours: list[float] = []
    theirs: list[float] = []
    with_it: list[float] = []
    without: list[float] = []
    for _ in range(rounds):
        result = run_program("recorded", str(pairs), timeout_s=_TIMEOUT_S)
        off, on = zip(*result["pairs"], strict=True)
        ours.append(sum(cpu for _, cpu, _ in on) / pairs - sum(cpu for _, cpu, _ in off) / pairs)
        theirs.append(result["subscriber_us"])
        with_it += [p99 for *_, p99 in on]
        without += [p99 for *_, p99 in off]
    return [
        Row(PUBLISHING, "CPU us/message", SUBSCRIBER, tuple(ours), tuple(theirs)),
        Row(PUBLISHING, "p99 us", WITHOUT, tuple(with_it), tuple(without)),
        _replay(),
    ]


def _replay() -> Row:
    with tempfile.TemporaryDirectory() as folder:
        bag = str(Path(folder) / "hour")
        run_program("hour_bag", bag, timeout_s=_TIMEOUT_S)
        words = ("replay", bag, "pipeline", "--replace", "sensor_simulator")
        took_s = wall_time_s("-m", "composer", *words, folder=ROOT)
    return Row(REPLAY, "s", MINUTE, (took_s,), (60.0,))
