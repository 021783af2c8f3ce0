"""Systems of N idle nodes: start-up, memory and shutdown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from benchmarks.figures import Row
from benchmarks.processes import ProgramFailed, run_program

HAND_WRITTEN = "hand-written LifecycleNodes"
COMPOSED = "all services"
LEAN = "introspection off"
_PROGRAMS = {
    COMPOSED: ("large_composed",),
    LEAN: ("large_composed", "--lean"),
    HAND_WRITTEN: ("large_hand_written",),
}
_FIGURES = {
    "start_s": ("start", "s"),
    "start_cpu_s": ("start", "CPU s"),
    "memory_mb": ("memory", "MB"),
    "stop_s": ("stop", "s"),
    "stop_cpu_s": ("stop", "CPU s"),
}
_TIMEOUT_S = 300.0


def measure(*, long: bool) -> list[Row]:
    """Measure all variants at each size. Raises ProgramFailed if the composer fails."""
    sizes, rounds = ((10, 100, 300), 5) if long else ((10, 100), 3)
    return [row for nodes in sizes for row in _of_size(nodes, rounds)]


def _of_size(nodes: int, rounds: int) -> list[Row]:
    results: dict[str, list[Mapping[str, Any] | None]] = {variant: [] for variant in _PROGRAMS}
    for turn in range(rounds):
        for variant in _PROGRAMS if turn % 2 == 0 else reversed(_PROGRAMS):
            results[variant].append(_run(variant, nodes))
    return [
        Row(
            f"{what}, N={nodes}, {variant}",
            unit,
            HAND_WRITTEN,
            _each(results[variant], key),
            theirs,
        )
        for key, (what, unit) in _FIGURES.items()
        for theirs in [_each(results[HAND_WRITTEN], key)]
        for variant in (COMPOSED, LEAN)
    ]


def _each(results: list[Mapping[str, Any] | None], key: str) -> tuple[float | None, ...]:
    return tuple(None if result is None else result[key] for result in results)


def _run(variant: str, nodes: int) -> Mapping[str, Any] | None:
    program, *arguments = _PROGRAMS[variant]
    try:
        return run_program(program, "--nodes", str(nodes), *arguments, timeout_s=_TIMEOUT_S)
    except ProgramFailed:
        if variant == HAND_WRITTEN:
            return None
        raise  # the composer must not fail
