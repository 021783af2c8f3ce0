"""Wall and CPU time of the start-up and shutdown of a system, and its memory."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field

from benchmarks.programs.work import memory_mb


@dataclass(frozen=True, slots=True)
class Size:
    """The number of nodes; ``lean`` disables introspection."""

    nodes: int
    lean: bool


def size_from_arguments() -> Size:
    """Parse the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--nodes", type=int, required=True)
    parser.add_argument("--lean", action="store_true")
    return Size(**vars(parser.parse_args()))


@dataclass(slots=True)
class Phases:
    """Timings of start-up and shutdown, without imports."""

    figures: dict[str, float] = field(default_factory=dict)
    _began_s: tuple[float, float] = (0.0, 0.0)

    def starts(self) -> None:
        """Mark the begin of the start-up."""
        self._began_s = _now_s()

    def has_started(self) -> None:
        """Mark that all nodes are active."""
        self._end("start")
        self.figures["memory_mb"] = memory_mb()

    def stops(self) -> None:
        """Mark the begin of the shutdown."""
        self._began_s = _now_s()

    def has_stopped(self) -> None:
        """Mark that the nodes have left the ROS graph."""
        self._end("stop")

    def _end(self, what: str) -> None:
        wall_s, cpu_s = _now_s()
        self.figures[f"{what}_s"] = wall_s - self._began_s[0]
        self.figures[f"{what}_cpu_s"] = cpu_s - self._began_s[1]


def _now_s() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()
