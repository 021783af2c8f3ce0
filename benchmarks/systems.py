"""Systems of N nodes, composed and by hand, in turn: messages, start-up, memory, timers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from benchmarks.figures import Row, percentile
from benchmarks.processes import ProgramFailed, run_program

COMPOSED = "composed"
SINGLE = "SingleThreadedExecutor"
MULTI = "MultiThreadedExecutor"
EVENTS = "EventsExecutor"

Rounds = Mapping[str, Sequence[Mapping[str, Any] | None]]
_PATIENCE_S = 60.0


def take_turns(ways: Sequence[str], rounds: int, nodes: int, *arguments: str) -> Rounds:
    """Run each way once a round and return what each measured; None where one gave no result.

    Every other round goes backwards, so that nobody always runs first.
    """
    found: dict[str, list[Mapping[str, Any] | None]] = {way: [] for way in ways}
    for turn in range(rounds):
        for way in ways if turn % 2 == 0 else tuple(reversed(ways)):
            found[way].append(_run(way, nodes, *arguments))
    return found


def rows(
    case: str, unit: str, rounds: Rounds, figure: Callable[[Mapping[str, Any]], float | None]
) -> list[Row]:
    """Return a row for each way by hand."""
    figures = {
        way: tuple(None if result is None else figure(result) for result in results)
        for way, results in rounds.items()
    }
    ours = figures.pop(COMPOSED)
    return [Row(case, unit, way, ours, theirs) for way, theirs in figures.items()]


def chain(*, long: bool) -> list[Row]:
    """Measure one message on its way round N nodes, and how these start."""
    sizes, rounds, seconds = ((3, 10, 30, 100, 300), 7, 3.0) if long else ((10, 100), 3, 0.6)
    found: list[Row] = []
    for nodes in sizes:
        # The short version leaves out what takes long and is known to be worse still.
        ways = (
            (COMPOSED, SINGLE, MULTI, EVENTS) if long or nodes <= 10 else (COMPOSED, SINGLE, EVENTS)
        )
        turns = take_turns(ways, rounds, nodes, "--seconds", str(seconds))
        found += rows(f"chain, N={nodes}", "CPU us/message", turns, _cpu_us_per_message)
        started = {way: turns[way] for way in (COMPOSED, SINGLE)}
        found += rows(f"start, N={nodes}", "s", started, lambda result: result["start_s"])
        found += rows(f"memory, N={nodes}", "MB", started, lambda result: result["memory_mb"])
    return found


def timers(*, long: bool) -> list[Row]:
    """Measure how far the time between two calls of a timer is from its period."""
    sizes, rounds, seconds = ((10, 100), 7, 10.0) if long else ((10,), 3, 1.0)
    found: list[Row] = []
    for nodes in sizes:
        for rate_hz in (100.0, 500.0):
            ways = (COMPOSED, SINGLE, EVENTS) if long else (COMPOSED, SINGLE)
            arguments = ("--seconds", str(seconds), "--timer-hz", str(rate_hz))
            turns = take_turns(ways, rounds, nodes, *arguments)
            for share in (0.5, 0.99):
                case = f"timer {rate_hz:g} Hz p{share * 100:g}, N={nodes}"
                figure = _jitter_us(rate_hz, share)
                found += rows(case, "jitter us", turns, figure)
            found += rows(
                f"timer {rate_hz:g} Hz, N={nodes}", "% left out", turns, _left_out(rate_hz)
            )
    return found


def _run(way: str, nodes: int, *arguments: str) -> Mapping[str, Any] | None:
    program, executor = ("composed", "events") if way == COMPOSED else ("hand_written", way)
    command = (program, executor, "--nodes", str(nodes), *arguments)
    try:
        return run_program(*command, timeout_s=_PATIENCE_S)
    except ProgramFailed:
        if way == COMPOSED:
            raise  # ours has to work
        return None


def _cpu_us_per_message(result: Mapping[str, Any]) -> float | None:
    return 1e6 * result["cpu_s"] / result["delivered"] if result["delivered"] else None


def _jitter_us(rate_hz: float, share: float) -> Callable[[Mapping[str, Any]], float | None]:
    def figure(result: Mapping[str, Any]) -> float | None:
        ticks = result["ticks_ns"]
        gaps_ns = [after - before for before, after in pairwise(ticks)]
        if not gaps_ns:
            return None
        return percentile([abs(gap - 1e9 / rate_hz) / 1000.0 for gap in gaps_ns], share)

    return figure


def _left_out(rate_hz: float) -> Callable[[Mapping[str, Any]], float | None]:
    """Return what tells the calls that never came: jitter alone would not show them."""

    def figure(result: Mapping[str, Any]) -> float | None:
        return 100.0 * max(0.0, 1.0 - len(result["ticks_ns"]) / (result["wall_s"] * rate_hz))

    return figure
