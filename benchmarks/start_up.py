"""Wall time of frequent commands that do not start a system.

The baseline is importing the third-party libraries in the same Python, so that the ratio shows the
cost of the composer itself. The commands run alternately, so that other load on the machine affects
all of them equally.
"""

from __future__ import annotations

from benchmarks.figures import Row
from benchmarks.processes import ROOT, wall_time_s

BASELINE = "importing yaml, typer"
COMMANDS = {
    BASELINE: ("-c", "import yaml, typer"),
    "compose --version": ("-m", "composer", "--version"),
    "compose validate systems nodes": ("-m", "composer", "validate", "systems", "nodes"),
    "compose graph systems/pipeline.yaml": ("-m", "composer", "graph", "systems/pipeline.yaml"),
}


def measure(*, long: bool) -> list[Row]:
    """Measure the commands alternately. Raises CalledProcessError if one fails."""
    turns = 15 if long else 4
    times_ms: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(turns + 1):
        for name, arguments in COMMANDS.items():
            times_ms[name].append(wall_time_s(*arguments, folder=ROOT) * 1000)
    # The first round is not counted, since it fills the disk cache.
    counted = {name: tuple(times[1:]) for name, times in times_ms.items()}
    theirs = counted.pop(BASELINE)
    return [Row(name, "wall ms", BASELINE, ours, theirs) for name, ours in counted.items()]
