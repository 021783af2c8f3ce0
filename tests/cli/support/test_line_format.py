"""What a run prints: log lines in RCUTILS_CONSOLE_OUTPUT_FORMAT, and a summary."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator

import pytest

from composer.cli.support.line_format import LineFormat, console_format, file_format
from composer.cli.support.progress import Progress, summary
from composer.client.run_log.reading import Record
from composer.model import LogLevel
from composer.runtime.supervision.events import BroughtUp, Logged, NodeSummary, Outcome

RECORD = Record(1_700_000_000_012_345_678, "warn", "robot.planner", "", "no {name} yet")


@pytest.fixture(autouse=True)
def time_zone() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TZ", "UTC")
        time.tzset()
        yield
    time.tzset()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[{severity}] [{name}] {message}", "[WARN] [robot.planner] no {name} yet"),
        ("{time}|{time_as_nanoseconds}", "1700000000.012345678|1700000000012345678"),
        ("{date_time_with_ms}", "2023-11-14 22:13:20.012"),
        ("{file_name}:{line_number} {function_name}", ":0 "),
        ("{unknown} {} {severity", "{unknown} {} {severity"),
        (r"a\tb\n", "a\tb\n"),
        ("", ""),
    ],
)
def test_tokens_are_replaced_as_by_rcutils(text: str, expected: str) -> None:
    assert LineFormat(text).render(RECORD) == expected


def test_lines_begin_with_the_elapsed_time_or_have_the_format_of_the_user(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def printed() -> str:
        stream = io.StringIO()
        progress = Progress(stream, console_format())
        progress.show(Logged(1.5, "planner", LogLevel.WARN, "no map"))
        progress.show(BroughtUp(2.0, 3, 3))
        return stream.getvalue()

    monkeypatch.delenv("RCUTILS_CONSOLE_OUTPUT_FORMAT", raising=False)
    assert console_format() is None
    assert printed() == (
        "[1.500] [WARN] [planner] no map\n"
        "[2.000] [INFO] [compose] 3 of 3 nodes active after 2.00 s\n"
    )
    # Log files have the date and time.
    assert LineFormat(file_format()).render(RECORD) == (
        "[2023-11-14 22:13:20.012] [WARN] [robot.planner] no {name} yet"
    )
    monkeypatch.setenv("RCUTILS_CONSOLE_OUTPUT_FORMAT", "{severity} {name}: {message}")
    assert printed() == "WARN planner: no map\nINFO compose: 3 of 3 nodes active after 2.00 s\n"
    assert file_format() == "{severity} {name}: {message}"


def test_counts_of_nodes_outside_the_process_are_not_known() -> None:
    nodes = [
        NodeSummary(name, "finalized", received, 0, 0, 0, 0, 0, in_process)
        for name, received, in_process in (("/planner", 30, True), ("/lidar", 0, False))
    ]
    shown = summary(Outcome(0, "--for elapsed", 2.0, tuple(nodes))).splitlines()
    assert shown[2].split() == ["/planner", "finalized", "30", "0", "0", "0", "0"]
    assert shown[3].split() == ["/lidar", "finalized", "-", "-", "-", "-", "-"]
