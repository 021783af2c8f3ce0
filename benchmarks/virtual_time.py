"""How much faster than real time scenarios run in virtual time."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.figures import Row
from benchmarks.processes import wall_time_s

ROOT = Path(__file__).parents[1]
#: A minute of a robot, and an hour with a restart every few seconds. The hour ends while all
#: nodes are up.
LASTING_S = {"pipeline": 60.0, "supervised": 3602.0}
ROUNDS = 3


def measure(*, long: bool) -> list[Row]:
    """Run ``compose test`` for each system, with the start of the program."""
    rows = []
    with tempfile.TemporaryDirectory(dir=ROOT) as folder:
        for system, for_s in LASTING_S.items():
            path = Path(folder) / f"{system}.yaml"
            text = f"scenario: {system}\nsystem: {system}\nfor_s: {for_s}\n"
            path.write_text(text, encoding="utf-8")
            rounds = ROUNDS * 3 if long else ROUNDS
            command = ("-m", "composer", "test", str(path))
            values = tuple(wall_time_s(*command, folder=ROOT) for _ in range(rounds))
            case = f"{system}, {for_s:g} s"
            rows.append(Row(case, "s", "real time", values, (for_s,) * rounds))
    return rows
