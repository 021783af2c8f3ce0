"""How long the commands take that people run often and that start nothing.

Each is measured against the same Python importing the libraries that any such tool would import,
so that the ratio says what the composer itself adds. The commands take turns, so that whatever else
the machine does meets all of them alike.
"""

from __future__ import annotations

from benchmarks.figures import Row
from benchmarks.processes import ROOT, wall_time_s

BASELINE = "importing yaml, jsonschema, typer"
COMMANDS = {
    BASELINE: ("-c", "import yaml, jsonschema, typer"),
    "compose --version": ("-m", "composer", "--version"),
    "compose validate systems nodes": ("-m", "composer", "validate", "systems", "nodes"),
    "compose graph systems/pipeline.yaml": ("-m", "composer", "graph", "systems/pipeline.yaml"),
}


def measure(*, long: bool) -> list[Row]:
    """Let the commands take turns. Raises CalledProcessError when one fails."""
    turns = 15 if long else 4
    times_ms: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for _ in range(turns + 1):
        for name, arguments in COMMANDS.items():
            times_ms[name].append(wall_time_s(*arguments, folder=ROOT) * 1000)
    # The first turn reads everything from the disk, which is not what is asked for.
    counted = {name: tuple(times[1:]) for name, times in times_ms.items()}
    theirs = counted.pop(BASELINE)
    return [Row(name, "wall ms", BASELINE, ours, theirs) for name, ours in counted.items()]
