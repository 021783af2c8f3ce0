"""What processes of a system report, and their counters over several lives."""

from __future__ import annotations

from typing import Any

import pytest

from composer.runtime.members.report import NodeFigures, parse_report
from composer.runtime.ros.diagnostic_arrays import Level, Status, write_array

SYSTEM = {
    "activity": "running",
    "host": "vm",
    "pid": "7",
    "started": "12.5",
    "is_child": "true",
    "participant": "010f",
    "last_step": "cafe 7",
}
NODE = {
    "state": "active",
    "held_down": "",
    "sent_hz": "2.0",
    "received_hz": "0.0",
    "busy": "0.1",
    "errors": "3",
    "overruns": "0",
    "queue_drops": "1",
    "calls": "4",
    "skipped": "0",
    "pid": "8",
    "sent": "/a=5 /b=1",
    "received": "",
    "dropped": "",
    "qos_events": "",
    "slowest": "",
}


def message(*statuses: tuple[str, dict[str, str]]) -> bytes:
    return write_array(0, [Status(Level.OK, name, "", "", values) for name, values in statuses])


def test_a_report_has_the_process_and_its_nodes() -> None:
    report = parse_report(message(("robot/sensing", SYSTEM), ("robot/sensing: /camera", NODE)))
    assert report is not None
    assert report.identity == ("vm", "7", 12.5)
    assert report.participant == "010f"
    assert (report.is_child, report.is_starting, report.is_stopping) == (True, False, False)
    camera = report.nodes["/camera"]
    assert (camera.state, camera.held_down) == ("active", "")
    assert camera.figures["sent"] == {"/a": 5, "/b": 1}
    assert (camera.figures["errors"], camera.figures["sent_hz"]) == (3, 2.0)
    assert (camera.figures["host"], camera.figures["pid"]) == ("vm", "8")  # of an executable


@pytest.mark.parametrize("activity", ["stopping", "stopped"])
def test_a_process_that_stops_says_so(activity: str) -> None:
    report = parse_report(message(("robot", {**SYSTEM, "activity": activity})))
    assert report is not None
    assert report.is_stopping


def test_a_report_of_another_version_has_no_figures() -> None:
    node = {**NODE, "errors": "none"}
    report = parse_report(message(("robot", {"activity": "running"}), ("robot: /camera", node)))
    assert report is not None
    assert report.nodes["/camera"].state == "active"
    assert report.nodes["/camera"].figures == {}
    assert parse_report(message()) is None
    assert parse_report(b"") is None
    assert parse_report(message(("robot", {**SYSTEM, "started": "nan"}))) is None


def test_a_report_says_which_step_was_received_last() -> None:
    report = parse_report(message(("robot", SYSTEM)))
    assert report is not None
    assert [report.received(sender) for sender in ("cafe", "other", "")] == [7, 0, 0]
    for text in ("", "cafe", "cafe x", " "):
        report = parse_report(message(("robot", {**SYSTEM, "last_step": text})))
        assert report is not None
        assert report.received("cafe") == 0


def counted(errors: int, sent: int) -> dict[str, Any]:
    return {"errors": errors, "sent": {"/a": sent}, "sent_hz": 1.0}


def test_counts_go_on_over_the_lives_of_a_process() -> None:
    figures = NodeFigures()
    figures.take(counted(2, 10), is_started_here=True)
    figures.take({}, is_started_here=True)  # of another version
    figures.end_life()
    figures.take(counted(1, 4), is_started_here=True)
    assert figures.current["errors"] == 3
    assert (figures.since_start["errors"], figures.since_start["sent"]) == (3, 14)


def test_what_an_earlier_process_has_counted_before_is_not_of_this_run() -> None:
    figures = NodeFigures()
    figures.take(counted(5, 100), is_started_here=False)
    figures.take(counted(6, 101), is_started_here=False)
    assert figures.current["errors"] == 6
    assert (figures.since_start["errors"], figures.since_start["sent"]) == (1, 1)
    figures.end_life()
    figures.take(counted(1, 7), is_started_here=False)  # a new process
    assert (figures.since_start["errors"], figures.since_start["sent"]) == (2, 8)
