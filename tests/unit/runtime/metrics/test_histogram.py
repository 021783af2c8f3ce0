"""Histograms of durations, the figures and rates computed from them, and their views."""

from __future__ import annotations

import threading
from dataclasses import replace
from random import Random

import pytest

from composer.cli.support.callback_tables import (
    SortKey,
    SystemMeter,
    in_order,
    summary_table,
    top_data,
    top_table,
)
from composer.client.systems.local_queries import with_processes
from composer.runtime.metrics.figures import CallbackMeter, CallbackRates, figures
from composer.runtime.metrics.statistics import CallbackStatistics, Histogram, Statistics
from composer.runtime.protocol.reports import (
    CallbackFigures,
    ChainFigures,
    NodeReport,
    SystemReport,
)


def counted(*times_s: float) -> Histogram:
    durations = Histogram()
    for time_s in times_s:
        durations.add(time_s)
    return durations


@pytest.mark.parametrize("scale_s", [2e-7, 1e-6, 3e-4, 0.05, 4.0])
def test_a_percentile_is_right_within_a_tenth(scale_s: float) -> None:
    random = Random(7)
    times_s = sorted(random.uniform(0.5, 1.5) * scale_s for _ in range(1000))
    durations = counted(*times_s)
    for share in (0.01, 0.5, 0.9, 0.99, 1.0):
        exact_s = times_s[max(0, round(share * 1000) - 1)]
        assert durations.percentile_s(share) == pytest.approx(exact_s, rel=0.11)
    assert durations.count == 1000
    assert durations.mean_s == pytest.approx(sum(times_s) / 1000)
    assert durations.longest_s == times_s[-1]


def test_an_empty_histogram_is_zero_and_values_beyond_the_scale_are_counted() -> None:
    durations = counted()
    assert (durations.count, durations.mean_s, durations.percentile_s(0.99)) == (0, 0.0, 0.0)
    durations = counted(0.0, 1e-9, 5000.0)
    assert durations.count == 3
    assert durations.percentile_s(1.0) == durations.longest_s == 5000.0
    assert durations.percentile_s(0.5) <= 1e-7


def test_a_duration_can_have_a_weight() -> None:
    durations = counted(0.5)
    durations.set_weight(16)
    durations.add(0.25)
    assert (durations.count, durations.total_s, durations.longest_s) == (17, 4.5, 0.5)
    durations.set_weight(1)
    durations.add(0.25)
    assert (durations.count, durations.total_s) == (18, 4.75)


def test_reading_during_counting_loses_nothing() -> None:
    durations = Histogram()
    asked: list[int] = []
    counting = threading.Thread(target=lambda: [durations.add(0.001) for _ in range(20_000)])
    counting.start()
    while counting.is_alive():
        asked.append(durations.count)
    assert durations.count == 20_000
    assert asked == sorted(asked)


def test_counting_continues_after_a_node_was_configured_again() -> None:
    statistics = Statistics()
    statistics.callback("timer", "tick").times.add(0.25)
    statistics.callback("timer", "tick").times.add(0.5)
    statistics.callback("subscription", "tick").dropped += 3
    assert statistics.busy_s == 0.75
    assert statistics.slowest == "timer 'tick' 500.0 ms"
    assert statistics.queue_drops == 3
    assert Statistics().slowest == ""


def test_figures_are_in_milliseconds() -> None:
    callback = CallbackStatistics("timer", "tick", counted(0.002, 0.004), counted(0.001), 1, 2)
    found = figures("/a/b", callback)
    assert (found.callback, found.count, found.overruns, found.dropped) == ("timer 'tick'", 2, 1, 2)
    assert found.mean_ms == pytest.approx(3.0)
    assert (found.longest_ms, found.late_longest_ms) == (4.0, 1.0)


def read(meter: CallbackMeter, at_s: float, *counts: int) -> list[tuple[float | None, ...]]:
    """Read a report with callbacks that are called for 10 ms; return their rates."""
    callbacks = [
        CallbackFigures(f"/n{number}", "timer", "tick", count=count, total_ms=10.0 * count)
        for number, count in enumerate(counts)
    ]
    return [(item.calls_hz, item.busy) for item in meter.read(callbacks, at_s)]


def test_calls_are_counted_from_burst_to_burst_once_there_are_two() -> None:
    meter = CallbackMeter()
    assert read(meter, 100.0, 10) == [(None, None)]
    assert read(meter, 102.0, 30, 7) == [(10.0, 0.1), (None, None)]
    assert read(meter, 102.1, 99, 9) == [(10.0, 0.1), (None, None)]  # a report about a state
    assert read(meter, 103.0, 32, 8) == [(2.0, pytest.approx(0.02)), (1.0, 0.01)]
    assert read(meter, 104.0, 0, 8)[0] == (None, None)  # a node that was created again


def test_the_rate_of_a_slow_callback_does_not_change_from_report_to_report() -> None:
    meter = CallbackMeter()
    found = [read(meter, 100.0 + second, second // 2)[0][0] for second in range(12)]
    assert found[4:] == [0.5] * 8


def report(at_s: float, *callbacks: CallbackFigures) -> SystemReport:
    timed = {"callbacks": callbacks, "callbacks_at_s": at_s}
    return SystemReport("/robot", "running", (), "robot1", "12", **timed)  # type: ignore[arg-type]


def two_reports() -> tuple[SystemReport, SystemReport]:
    before = report(
        1.0, CallbackFigures("/a", "timer", "tick"), CallbackFigures("/b", "subscription", "scan")
    )
    now = report(
        2.0,
        CallbackFigures("/a", "timer", "tick", 50, 100.0, 2.0, 3.0, 4.0, 0.5, 1.0, 6, 0),
        CallbackFigures("/b", "subscription", "scan", 10, 200.0, 20.0, 2.0, 30.0, dropped=8),
    )
    return before, now


def rates(*reports: SystemReport) -> list[CallbackRates]:
    meter = SystemMeter()
    return [meter.read(item) for item in reports][-1]


def test_top_shows_one_line_per_callback_up_to_the_height_of_the_terminal() -> None:
    before, now = two_reports()
    for node, keys in (
        ("/a", (SortKey.CALLS, SortKey.P99, SortKey.LATE, SortKey.NODE)),
        ("/b", (SortKey.BUSY, SortKey.MEAN, SortKey.MAX, SortKey.DROPPED)),
    ):
        firsts = [in_order(rates(before, now), key)[0].figures.node for key in keys]
        assert firsts == [node] * 4
    found = in_order(rates(before, now), SortKey.NODE)
    assert top_table(now, found) == (
        "/robot: running, 0 of 0 nodes active (host robot1, process 12), callbacks 30.0 % busy\n"
        "node  callback             calls/s  busy %  mean ms  p99 ms  max ms  late ms  over  "
        "dropped\n"
        "/a    timer 'tick'            50.0   10.00    2.000   3.000   4.000    0.500     6\n"
        "/b    subscription 'scan'     10.0   20.00   20.000   2.000  30.000                 "
        "      8"
    )
    assert top_table(now, found, 3).splitlines()[2:] == ["2 more"]
    assert top_data(now, found)["callbacks"][0]["calls_hz"] == 50.0
    summary = summary_table(now.callbacks, 1).splitlines()  # of the slowest callbacks
    assert summary[1].split()[0] == "/b"
    assert summary[2] == "1 more callbacks took less time"


def node(name: str, process: str) -> NodeReport:
    return NodeReport(name, "active", state="active", process=process)


def whole(at_s: float, others_at_s: float, calls: int) -> SystemReport:
    """Return a report with the callbacks of another process, which has reported at its own time."""
    other = replace(
        report(others_at_s, CallbackFigures("/b", "timer", "tick", calls)),
        chains=(ChainFigures("way", 10.0, calls), ChainFigures("unknown", 1.0, 1)),
    )
    own = replace(
        report(at_s, CallbackFigures("/a", "timer", "tick", calls)),
        nodes=(node("/a", ""), node("/b", "acting")),
        chains=(ChainFigures("way", 10.0),),
    )
    return with_processes(own, {"acting": other} if others_at_s else {})


def test_rates_of_other_processes_are_those_between_their_own_reports() -> None:
    before, now = whole(1.0, 0.5, 10), whole(2.0, 2.5, 30)
    assert now.processes == {"acting": "/robot/acting"}
    found = {item.figures.node: item.calls_hz for item in rates(before, now)}
    assert found == {"/a": 20.0, "/b": 10.0}
    assert [(chain.chain, chain.count) for chain in now.chains] == [("way", 30)]


def test_a_process_has_rates_once_two_of_its_reports_are_apart() -> None:
    meter = SystemMeter()
    for at_s, others_at_s, rated_s in (
        (1.0, 0.0, None),  # it has not reported yet
        (2.0, 2.4, None),
        (3.0, 2.5, None),  # a report about a new subscription
        (3.5, 3.4, 3.4),
        (4.0, 3.4, 3.4),
    ):
        now = whole(at_s, others_at_s, round(10 * at_s))
        found = {item.figures.node: item.calls_hz for item in meter.read(now)}
        assert meter.rated_s(now)["acting"] == rated_s
        assert (found.get("/b") is None) == (rated_s is None)
