"""The output of child processes: lines, whatever the process writes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from composer.model import LogLevel
from composer.runtime.children.output import OutputLines, attribute_line, process_loggers


def lines_of(*chunks: bytes, now_s: float = 0.0) -> list[str]:
    found: list[str] = []
    output = OutputLines(found.append)
    for chunk in chunks:
        output.add(chunk, now_s)
    output.finish()
    return found


@pytest.mark.parametrize(
    ("chunks", "lines"),
    [
        ([b"one\ntwo\n"], ["one", "two"]),
        ([b"on", b"e\ntw", b"o"], ["one", "two"]),
        ([b"one\r\n\n  \ntwo\n"], ["one", "", "  ", "two"]),
        ([b"\x1b[31mred\x1b[0m\n"], ["red"]),
        ([b"bad \xff\n"], ["bad \\xff"]),
        ([b"x" * 5000 + b"\nnext\n"], ["x" * 2000 + " ...", "next"]),
        ([b"x" * 3000, b"x" * 3000, b"\nnext\n"], ["x" * 2000 + " ...", "next"]),
    ],
)
def test_lines(chunks: list[bytes], lines: list[str]) -> None:
    assert lines_of(*chunks) == lines


def test_a_flood_is_cut_and_counted() -> None:
    found: list[str] = []
    output = OutputLines(found.append)
    output.add(b"again\n" * 5000, 1.0)
    output.add(b"later\n", 2.0)
    assert found.count("again") == 500
    assert found[500:] == ["(4500 lines were dropped: more than 500 a second)", "later"]


@given(st.lists(st.binary(max_size=3000), max_size=8))
def test_any_output_becomes_short_lines(chunks: list[bytes]) -> None:
    for line in lines_of(*chunks):
        assert "\n" not in line
        assert len(line) <= 4 * 2000 + 4  # each invalid byte becomes four characters


@pytest.mark.parametrize(
    ("text", "is_error", "expected"),
    [
        ("plain", False, (LogLevel.INFO, "arm", "plain")),
        ("plain", True, (LogLevel.WARN, "arm", "plain")),
        ("[NOTE] [arm] ready", False, (LogLevel.INFO, "arm", "[NOTE] [arm] ready")),
        ("[INFO] [arm]: ready", True, (LogLevel.INFO, "arm", "ready")),
        ("[ERROR] [arm.driver] it hurts", True, (LogLevel.ERROR, "arm.driver", "it hurts")),
        ("[ERROR] [hand] it hurts", False, (LogLevel.ERROR, "hand", "it hurts")),
        ("[ERROR] [arms] it hurts", False, (LogLevel.ERROR, "arm", "[arms] it hurts")),
        (
            "[1.5] [FATAL] [compose]: /x failed",
            True,
            (LogLevel.FATAL, "arm", "[compose] /x failed"),
        ),
    ],
)
def test_a_program_has_its_own_loggers_only(
    text: str, is_error: bool, expected: tuple[LogLevel, str, str]
) -> None:
    assert attribute_line(text, ("arm", "hand"), is_error=is_error) == expected


def test_a_process_speaks_only_for_itself_and_its_nodes() -> None:
    loggers = process_loggers("second", ["/left/arm"])
    for text, expected in (
        ("[FATAL] [compose] /x failed", (LogLevel.FATAL, "second", "[compose] /x failed")),
        ("[FATAL] [other] /x failed", (LogLevel.FATAL, "second", "[other] /x failed")),
        ("[INFO] [left.arm] ready", (LogLevel.INFO, "left.arm", "ready")),
    ):
        assert attribute_line(text, loggers, is_error=True) == expected
