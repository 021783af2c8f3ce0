"""Systems of N nodes: the composer compared with hand-written programs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from benchmarks.figures import Row, percentile
from benchmarks.processes import on_one_processor
from benchmarks.rounds import (
    BARE,
    COMPOSED,
    EVENTS,
    MULTI,
    SINGLE,
    UNTRACED,
    Case,
    Figure,
    rows,
    run_rounds,
    run_time_slices,
)

CPU = "CPU us/message"


def ring(*, long: bool) -> list[Row]:
    """Measure a message that circulates through N nodes, and their start-up."""
    sizes, rounds, seconds = ((3, 10, 30, 100, 300), 7, 3.0) if long else ((10, 100), 3, 0.6)
    measured: list[Row] = []
    for nodes in sizes:
        # The short version omits the slowest variant.
        variants = (
            (COMPOSED, SINGLE, MULTI, EVENTS) if long or nodes <= 10 else (COMPOSED, SINGLE, EVENTS)
        )
        turns = run_rounds(variants, Case("ring", nodes, seconds, rounds))
        measured += rows(f"ring, N={nodes}", CPU, turns, cpu_us)
        started = {variant: turns[variant] for variant in (COMPOSED, SINGLE)}
        measured += rows(f"start, N={nodes}", "s", started, lambda result: result["start_s"])
        measured += rows(f"memory, N={nodes}", "MB", started, lambda result: result["memory_mb"])
    return measured


def growth(*, long: bool) -> list[Row]:
    """Measure the cost per message in a large and in a small system of the composer."""
    rounds, seconds = (7, 3.0) if long else (3, 0.6)
    small, large = 10, 300
    measured: dict[int, list[float | None]] = {small: [], large: []}
    for turn in range(rounds):
        for nodes in (small, large) if turn % 2 == 0 else (large, small):
            result = run_rounds((COMPOSED,), Case("ring", nodes, seconds, 1))[COMPOSED][0]
            measured[nodes].append(None if result is None else cpu_us(result))
    ours, theirs = tuple(measured[large]), tuple(measured[small])
    return [Row(f"ring, N={large}", CPU, f"composer, N={small}", ours, theirs)]


def streams(*, long: bool) -> list[Row]:
    """Measure messages at a fixed rate, in chains and stars."""
    measured: list[Row] = []
    for shape, nodes, message in _streams(long=long):
        rate_hz = 30.0 if message == "Image" else 100.0
        # A hand-written system of 300 nodes takes a minute to start.
        rounds, seconds = (7 if nodes <= 30 else 3, 3.0) if long else (3, 1.0)
        case = Case(shape, nodes, seconds, rounds, rate_hz, message)
        variants = [COMPOSED, EVENTS, SINGLE, MULTI] if long else [COMPOSED, EVENTS]
        if (shape, message) == ("chain", "String"):
            variants.append(BARE)
        turns = run_rounds(variants, case)
        measured += rows(f"{shape}, {message} {rate_hz:g} Hz, N={nodes}", CPU, turns, cpu_us)
        measured += rows(
            f"{shape}, {message} {rate_hz:g} Hz, N={nodes}",
            "% lost",
            turns,
            _lost(case),
        )
    return measured


def _streams(*, long: bool) -> list[tuple[str, int, str]]:
    if not long:
        few = [("chain", 10, "String"), ("chain", 100, "String"), ("chain", 10, "Image")]
        return [*few, ("star", 10, "String")]
    return [
        (shape, nodes, message)
        for message in ("String", "LaserScan", "Image")
        for shape in ("chain", "star")
        for nodes in (3, 10, 30, 100, 300)
    ]


def hops(*, long: bool) -> list[Row]:
    """Measure the latency between two nodes in a system of N nodes."""
    sizes, rounds, seconds = ((10, 100), 7, 3.0) if long else ((100,), 3, 1.0)
    rates_hz = (100.0, 500.0, 1000.0) if long else (1000.0,)
    measured: list[Row] = []
    for nodes in sizes:
        for rate_hz in rates_hz:
            case = Case("hop", nodes, seconds, rounds, rate_hz)
            turns = run_rounds((COMPOSED, EVENTS, BARE), case)
            for share in (0.5, 0.99):
                name = f"hop {rate_hz:g} Hz p{share * 100:g}, N={nodes}"
                measured += rows(name, "latency us", turns, _took_us(share))
    return measured


def timers(*, long: bool) -> list[Row]:
    """Measure the jitter of a timer period and the number of skipped calls."""
    sizes, rounds, seconds = ((10, 100), 7, 10.0) if long else ((100,), 3, 1.0)
    rates_hz = (100.0, 500.0, 1000.0) if long else (500.0,)
    measured: list[Row] = []
    for nodes in sizes:
        for rate_hz in rates_hz:
            variants = (COMPOSED, SINGLE, EVENTS) if long else (COMPOSED, EVENTS)
            turns = run_rounds(variants, Case("timer", nodes, seconds, rounds, rate_hz))
            for share in (0.5, 0.99):
                case = f"timer {rate_hz:g} Hz p{share * 100:g}, N={nodes}"
                measured += rows(case, "jitter us", turns, _jitter_us(rate_hz, share))
            name = f"timer {rate_hz:g} Hz, N={nodes}"
            measured += rows(name, "% skipped", turns, _skipped(rate_hz))
    return measured


def calls(*, long: bool) -> list[Row]:
    """Measure sequential service calls and action goals."""
    rounds, seconds = (7, 3.0) if long else (3, 0.6)
    measured: list[Row] = []
    for shape in ("service", "action"):
        for nodes in (2, 100) if long else (10,):
            variants = (COMPOSED, SINGLE, EVENTS) if long and nodes <= 10 else (COMPOSED, EVENTS)
            turns = run_rounds(variants, Case(shape, nodes, seconds, rounds))
            case = f"{shape}, N={nodes}"
            measured += rows(f"{case}, p50", "round trip us", turns, _took_us(0.5))
            measured += rows(case, "CPU us/call", turns, cpu_us)
    return measured


def hosted(*, long: bool) -> list[Row]:
    """Measure a talker and a listener of rclpy node classes, hosted and on rclpy's executors."""
    rounds, seconds = (7, 3.0) if long else (3, 1.0)
    measured: list[Row] = []
    for message, rate_hz in (("String", 100.0), ("String", 1000.0), ("LaserScan", 100.0)):
        case = Case("pair", 2, seconds, rounds, rate_hz, message)
        turns = run_rounds((COMPOSED, EVENTS, SINGLE), case)
        name = f"hosted pair, {message} {rate_hz:g} Hz"
        measured += rows(name, CPU, turns, cpu_us)
        measured += rows(f"{name}, p50", "latency us", turns, _took_us(0.5))
        measured += rows(name, "% lost", turns, _lost(case))
    return measured


def external(*, long: bool) -> list[Row]:
    """Measure the CPU of one of two processes that exchange a single message, and large ones."""
    rounds, seconds = (9, 3.0) if long else (5, 2.0)
    variants = (COMPOSED, SINGLE, EVENTS, BARE) if long else (COMPOSED, EVENTS, BARE)
    case = Case("ring", 2, seconds, rounds, apart=True)
    with on_one_processor():
        near = run_time_slices(variants, case)
    far = run_time_slices(variants, case)
    measured = rows("external process, one processor", CPU, near, cpu_us)
    measured += rows("external process, all processors", CPU, far, cpu_us)
    images = Case("ring", 2, seconds, rounds, message="Image", apart=True)
    turns = run_rounds((COMPOSED, EVENTS), images)
    return measured + rows("external process, Image", "us/message", turns, interval_us)


def tracing(*, long: bool) -> list[Row]:
    """Measure the cost of recording callback timings."""
    rounds, seconds = (15, 2.0) if long else (9, 1.0)
    turns = run_time_slices((COMPOSED, UNTRACED), Case("ring", 10, seconds, rounds))
    return rows("ring, N=10", CPU, turns, cpu_us)


def cpu_us(result: Mapping[str, Any]) -> float | None:
    """Return the CPU time per message; None if none was delivered."""
    return 1e6 * result["cpu_s"] / result["delivered"] if result["delivered"] else None


def interval_us(result: Mapping[str, Any]) -> float | None:
    """Return the time per message of the process; None if none was delivered."""
    return 1e6 * result["wall_s"] / result["delivered"] if result["delivered"] else None


def _lost(case: Case) -> Figure:
    """Return a function for the percentage of lost messages, which CPU usage does not show."""
    expected_hz = case.rate_hz * (case.nodes - 1)

    def figure(result: Mapping[str, Any]) -> float | None:
        return 100.0 * max(0.0, 1.0 - result["delivered"] / (result["wall_s"] * expected_hz))

    return figure


def _took_us(share: float) -> Figure:
    def figure(result: Mapping[str, Any]) -> float | None:
        took_ns = result["took_ns"]
        return percentile(took_ns, share) / 1000.0 if took_ns else None

    return figure


def _jitter_us(rate_hz: float, share: float) -> Figure:
    def figure(result: Mapping[str, Any]) -> float | None:
        ticks = result["ticks_ns"]
        gaps_ns = [after - before for before, after in pairwise(ticks)]
        if not gaps_ns:
            return None
        return percentile([abs(gap - 1e9 / rate_hz) / 1000.0 for gap in gaps_ns], share)

    return figure


def _skipped(rate_hz: float) -> Figure:
    """Return a function for the percentage of skipped calls, which jitter does not show."""

    def figure(result: Mapping[str, Any]) -> float | None:
        return 100.0 * max(0.0, 1.0 - len(result["ticks_ns"]) / (result["wall_s"] * rate_hz))

    return figure
