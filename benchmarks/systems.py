"""Systems of N nodes, composed and by hand, in turn."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from benchmarks.figures import Row, percentile
from benchmarks.processes import on_one_processor
from benchmarks.turns import (
    BARE,
    COMPOSED,
    EVENTS,
    MULTI,
    SINGLE,
    UNTRACED,
    Case,
    Figure,
    rows,
    take_short_turns,
    take_turns,
)

CPU = "CPU us/message"


def ring(*, long: bool) -> list[Row]:
    """Measure one message on its way round N nodes, and how these start."""
    sizes, rounds, seconds = ((3, 10, 30, 100, 300), 7, 3.0) if long else ((10, 100), 3, 0.6)
    found: list[Row] = []
    for nodes in sizes:
        # The short version leaves out what takes long and is known to be worse still.
        ways = (
            (COMPOSED, SINGLE, MULTI, EVENTS) if long or nodes <= 10 else (COMPOSED, SINGLE, EVENTS)
        )
        turns = take_turns(ways, Case("ring", nodes, seconds, rounds))
        found += rows(f"ring, N={nodes}", CPU, turns, cpu_us)
        started = {way: turns[way] for way in (COMPOSED, SINGLE)}
        found += rows(f"start, N={nodes}", "s", started, lambda result: result["start_s"])
        found += rows(f"memory, N={nodes}", "MB", started, lambda result: result["memory_mb"])
    return found


def growth(*, long: bool) -> list[Row]:
    """Measure what a message costs the composer in a large system and in a small one."""
    rounds, seconds = (7, 3.0) if long else (3, 0.6)
    small, large = 10, 300
    found: dict[int, list[float | None]] = {small: [], large: []}
    for turn in range(rounds):
        for nodes in (small, large) if turn % 2 == 0 else (large, small):
            result = take_turns((COMPOSED,), Case("ring", nodes, seconds, 1))[COMPOSED][0]
            found[nodes].append(None if result is None else cpu_us(result))
    ours, theirs = tuple(found[large]), tuple(found[small])
    return [Row(f"ring, N={large}", CPU, f"the composer, N={small}", ours, theirs)]


def streams(*, long: bool) -> list[Row]:
    """Measure messages that come at a rate, through chains and from the middle of stars."""
    found: list[Row] = []
    for shape, nodes, message in _streams(long=long):
        rate_hz = 30.0 if message == "Image" else 100.0
        # By hand it takes a minute to start 300 nodes.
        rounds, seconds = (7 if nodes <= 30 else 3, 3.0) if long else (3, 1.0)
        case = Case(shape, nodes, seconds, rounds, rate_hz, message)
        ways = [COMPOSED, EVENTS, SINGLE, MULTI] if long else [COMPOSED, EVENTS]
        if (shape, message) == ("chain", "String"):
            ways.append(BARE)
        turns = take_turns(ways, case)
        found += rows(f"{shape}, {message} {rate_hz:g} Hz, N={nodes}", CPU, turns, cpu_us)
        found += rows(
            f"{shape}, {message} {rate_hz:g} Hz, N={nodes}",
            "% lost",
            turns,
            _lost(case),
        )
    return found


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
    """Measure how long a message takes from one node to another, among N that are idle."""
    sizes, rounds, seconds = ((10, 100), 7, 3.0) if long else ((100,), 3, 1.0)
    rates_hz = (100.0, 500.0, 1000.0) if long else (1000.0,)
    found: list[Row] = []
    for nodes in sizes:
        for rate_hz in rates_hz:
            case = Case("hop", nodes, seconds, rounds, rate_hz)
            turns = take_turns((COMPOSED, EVENTS, BARE), case)
            for share in (0.5, 0.99):
                name = f"hop {rate_hz:g} Hz p{share * 100:g}, N={nodes}"
                found += rows(name, "latency us", turns, _took_us(share))
    return found


def timers(*, long: bool) -> list[Row]:
    """Measure how far the time between two calls of a timer is from its period."""
    sizes, rounds, seconds = ((10, 100), 7, 10.0) if long else ((100,), 3, 1.0)
    rates_hz = (100.0, 500.0, 1000.0) if long else (500.0,)
    found: list[Row] = []
    for nodes in sizes:
        for rate_hz in rates_hz:
            ways = (COMPOSED, SINGLE, EVENTS) if long else (COMPOSED, EVENTS)
            turns = take_turns(ways, Case("timer", nodes, seconds, rounds, rate_hz))
            for share in (0.5, 0.99):
                case = f"timer {rate_hz:g} Hz p{share * 100:g}, N={nodes}"
                found += rows(case, "jitter us", turns, _jitter_us(rate_hz, share))
            name = f"timer {rate_hz:g} Hz, N={nodes}"
            found += rows(name, "% left out", turns, _left_out(rate_hz))
    return found


def calls(*, long: bool) -> list[Row]:
    """Measure calls and goals, each begun when the one before has ended."""
    rounds, seconds = (7, 3.0) if long else (3, 0.6)
    found: list[Row] = []
    for shape in ("service", "action"):
        for nodes in (2, 100) if long else (10,):
            ways = (COMPOSED, SINGLE, EVENTS) if long and nodes <= 10 else (COMPOSED, EVENTS)
            turns = take_turns(ways, Case(shape, nodes, seconds, rounds))
            case = f"{shape}, N={nodes}"
            found += rows(f"{case}, p50", "round trip us", turns, _took_us(0.5))
            found += rows(case, "CPU us/call", turns, cpu_us)
    return found


def outside(*, long: bool) -> list[Row]:
    """Measure messages between two processes, one in flight: the CPU of one of them."""
    rounds, seconds = (9, 3.0) if long else (5, 2.0)
    ways = (COMPOSED, SINGLE, EVENTS, BARE) if long else (COMPOSED, EVENTS, BARE)
    case = Case("ring", 2, seconds, rounds, apart=True)
    with on_one_processor():
        near = take_short_turns(ways, case)
    far = take_short_turns(ways, case)
    found = rows("DDS to another process, one processor", CPU, near, cpu_us)
    return found + rows("DDS to another process, all processors", CPU, far, cpu_us)


def tracing(*, long: bool) -> list[Row]:
    """Measure what it costs to take the times of callbacks."""
    rounds, seconds = (15, 2.0) if long else (9, 1.0)
    turns = take_short_turns((COMPOSED, UNTRACED), Case("ring", 10, seconds, rounds))
    return rows("ring, N=10", CPU, turns, cpu_us)


def cpu_us(result: Mapping[str, Any]) -> float | None:
    """Return the CPU for each message; None when none was delivered."""
    return 1e6 * result["cpu_s"] / result["delivered"] if result["delivered"] else None


def _lost(case: Case) -> Figure:
    """Return what tells the messages that did not come: CPU alone would not show them."""
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


def _left_out(rate_hz: float) -> Figure:
    """Return what tells the calls that never came: jitter alone would not show them."""

    def figure(result: Mapping[str, Any]) -> float | None:
        return 100.0 * max(0.0, 1.0 - len(result["ticks_ns"]) / (result["wall_s"] * rate_hz))

    return figure
