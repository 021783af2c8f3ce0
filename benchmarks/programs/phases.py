"""How long a system takes to start and to stop, in wall time and CPU time, and its memory."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field

from benchmarks.programs.work import memory_mb


@dataclass(frozen=True, slots=True)
class Size:
    """How many nodes there are; ``lean`` nodes have given up what is for tools."""

    nodes: int
    lean: bool


def size_from_arguments() -> Size:
    """Read the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--nodes", type=int, required=True)
    parser.add_argument("--lean", action="store_true")
    return Size(**vars(parser.parse_args()))


@dataclass(slots=True)
class Phases:
    """Takes the times of a start and a stop. What is imported by then is not counted."""

    figures: dict[str, float] = field(default_factory=dict)
    _began_s: tuple[float, float] = (0.0, 0.0)

    def starts(self) -> None:
        """Note that the start begins."""
        self._began_s = _now_s()

    def has_started(self) -> None:
        """Note that all nodes are active."""
        self._end("start")
        self.figures["memory_mb"] = memory_mb()

    def stops(self) -> None:
        """Note that the stop begins."""
        self._began_s = _now_s()

    def has_stopped(self) -> None:
        """Note that the nodes are gone from the ROS graph."""
        self._end("stop")

    def _end(self, what: str) -> None:
        wall_s, cpu_s = _now_s()
        self.figures[f"{what}_s"] = wall_s - self._began_s[0]
        self.figures[f"{what}_cpu_s"] = cpu_s - self._began_s[1]


def _now_s() -> tuple[float, float]:
    return time.perf_counter(), time.process_time()
