"""The counters of nodes in other processes, over several lives of these."""

from __future__ import annotations

import pytest

from composer.runtime.members.lives import NodeFigures
from composer.runtime.protocol.reports import NodeReport, SystemReport


def counted(errors: int, sent: int, host: str = "") -> NodeReport:
    return NodeReport("/a", "active", errors=errors, sent={"/a": sent}, sent_hz=1.0, host=host)


def test_counts_go_on_over_the_lives_of_a_process() -> None:
    figures = NodeFigures()
    figures.take(counted(2, 10), "vm", is_started_here=True)
    figures.end_life()
    figures.take(counted(1, 4), "vm", is_started_here=True)
    assert figures.current["errors"] == 3
    assert (figures.since_start["errors"], figures.since_start["sent"]) == (3, 14)


def test_what_an_earlier_process_has_counted_before_is_not_of_this_run() -> None:
    figures = NodeFigures()
    figures.take(counted(5, 100), "vm", is_started_here=False)
    figures.take(counted(6, 101), "vm", is_started_here=False)
    assert figures.current["errors"] == 6
    assert (figures.since_start["errors"], figures.since_start["sent"]) == (1, 1)
    figures.end_life()
    figures.take(counted(1, 7), "vm", is_started_here=False)  # a new process
    assert (figures.since_start["errors"], figures.since_start["sent"]) == (2, 8)


def test_the_host_is_that_of_the_process_unless_the_node_has_another_one() -> None:
    figures = NodeFigures()
    for host, expected in (("", "vm"), ("arm", "arm")):
        figures.take(counted(0, 0, host), "vm", is_started_here=True)
        assert figures.current["host"] == expected


@pytest.mark.parametrize("activity", ["stopping", "stopped"])
def test_a_process_that_stops_says_so(activity: str) -> None:
    assert SystemReport("robot", activity, (), "vm", "7").is_stopping
