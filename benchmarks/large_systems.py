"""Systems of N nodes that do nothing: how they start, what they hold, how they stop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from benchmarks.figures import Row
from benchmarks.processes import ProgramFailed, run_program

BY_HAND = "LifecycleNodes, by hand"
COMPOSED = "all services"
LEAN = "introspection off"
_PROGRAMS = {
    COMPOSED: ("large_composed",),
    LEAN: ("large_composed", "--lean"),
    BY_HAND: ("large_hand_written",),
}
_FIGURES = {
    "start_s": ("start", "s"),
    "start_cpu_s": ("start", "CPU s"),
    "memory_mb": ("memory", "MB"),
    "stop_s": ("stop", "s"),
    "stop_cpu_s": ("stop", "CPU s"),
}
_PATIENCE_S = 300.0


def measure(*, long: bool) -> list[Row]:
    """Let the ways take turns at each size. Raises ProgramFailed when one of ours fails."""
    sizes, rounds = ((10, 100, 300), 5) if long else ((10, 100), 3)
    return [row for nodes in sizes for row in _of_size(nodes, rounds)]


def _of_size(nodes: int, rounds: int) -> list[Row]:
    found: dict[str, list[Mapping[str, Any] | None]] = {way: [] for way in _PROGRAMS}
    for turn in range(rounds):
        for way in _PROGRAMS if turn % 2 == 0 else reversed(_PROGRAMS):
            found[way].append(_run(way, nodes))
    return [
        Row(f"{what}, N={nodes}, {way}", unit, BY_HAND, _each(found[way], key), theirs)
        for key, (what, unit) in _FIGURES.items()
        for theirs in [_each(found[BY_HAND], key)]
        for way in (COMPOSED, LEAN)
    ]


def _each(results: list[Mapping[str, Any] | None], key: str) -> tuple[float | None, ...]:
    return tuple(None if result is None else result[key] for result in results)


def _run(way: str, nodes: int) -> Mapping[str, Any] | None:
    program, *arguments = _PROGRAMS[way]
    try:
        return run_program(program, "--nodes", str(nodes), *arguments, timeout_s=_PATIENCE_S)
    except ProgramFailed:
        if way == BY_HAND:
            return None
        raise  # ours has to work
