"""How long the commands take that people run often and that start nothing.

Each is measured against the same Python importing the libraries that any such tool would import,
so that the ratio says what the composer itself adds. The commands take turns, so that whatever else
the machine does meets all of them alike.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Sequence

from benchmarks.figures import Row
from benchmarks.processes import ROOT

BASELINE = "importing yaml, jsonschema, typer"
COMMANDS = {
    BASELINE: ("-c", "import yaml, jsonschema, typer"),
    "compose --version": ("-m", "composer", "--version"),
    "compose validate systems nodes": ("-m", "composer", "validate", "systems", "nodes"),
    "compose graph systems/pipeline.yaml": ("-m", "composer", "graph", "systems/pipeline.yaml"),
}


def _wall_time_ms(arguments: Sequence[str]) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, capture_output=True)
    return (time.perf_counter() - start) * 1000


def measure(*, long: bool) -> list[Row]:
    """Let the commands take turns. Raises CalledProcessError when one fails."""
    turns = 15 if long else 4
    times_ms: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(turns + 1):
        for name, arguments in COMMANDS.items():
            times_ms[name].append(_wall_time_ms(arguments))
    # The first turn reads everything from the disk, which is not what is asked for.
    counted = {name: tuple(times[1:]) for name, times in times_ms.items()}
    theirs = counted.pop(BASELINE)
    return [Row(name, "wall ms", BASELINE, ours, theirs) for name, ours in counted.items()]
