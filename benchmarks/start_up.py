"""How long the commands take that people run often and that start nothing.

Each is measured against the same Python importing the libraries that any such tool would import,
so that the ratio says what the composer itself adds. The commands take turns, so that whatever else
the machine does meets all of them alike; the median counts, and the quartiles say how far it can be
trusted.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
TURNS = 15
BASELINE = "importing yaml, jsonschema, typer"
COMMANDS = {
    BASELINE: ("-c", "import yaml, jsonschema, typer"),
    "compose --version": ("-m", "composer", "--version"),
    "compose validate systems nodes": ("-m", "composer", "validate", "systems", "nodes"),
    "compose graph systems/pipeline.yaml": ("-m", "composer", "graph", "systems/pipeline.yaml"),
}


@dataclass(frozen=True, slots=True)
class Row:
    """One command: wall times in milliseconds."""

    name: str
    times_ms: Sequence[float]

    @property
    def median_ms(self) -> float:
        return statistics.median(self.times_ms)

    @property
    def quartiles_ms(self) -> tuple[float, float]:
        first, _, third = statistics.quantiles(self.times_ms, n=4)
        return first, third


def _wall_time_ms(arguments: Sequence[str]) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, capture_output=True)
    return (time.perf_counter() - start) * 1000


def measure(turns: int = TURNS) -> list[Row]:
    """Let the commands take turns. Raises CalledProcessError when one fails."""
    times_ms: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(turns + 1):
        for name, arguments in COMMANDS.items():
            times_ms[name].append(_wall_time_ms(arguments))
    # The first turn reads everything from the disk, which is not what is asked for.
    return [Row(name, times[1:]) for name, times in times_ms.items()]


def main() -> None:
    rows = measure()
    baseline_ms = next(row.median_ms for row in rows if row.name == BASELINE)
    print(f"Start-up: wall time of {TURNS} turns")
    print(f"  {'':<38}{'median':>10}{'quartiles':>18}{'ratio':>8}")
    for row in rows:
        first_ms, third_ms = row.quartiles_ms
        spread = f"{first_ms:.0f} - {third_ms:.0f} ms"
        ratio = row.median_ms / baseline_ms
        print(f"  {row.name:<38}{row.median_ms:>7.0f} ms{spread:>18}{ratio:>8.2f}")
