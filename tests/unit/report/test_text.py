"""The text format: every mark is under its value."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from composer.base.characters import width
from composer.base.diagnostics import Label, Severity
from composer.base.source import SourceFile, Span
from composer.report.text import render, summary
from tests.unit.support.reporting import diagnostic, rule


@pytest.mark.parametrize(
    ("text", "marked"),
    [
        ("key:\t{a: wrong}", "wrong"),
        ("名前: {日本語: wrong}", "wrong"),
        ("e\u0301e\u0301: wrong", "wrong"),
        ("plain: 誤り", "誤り"),
        ("x" * 300 + " wrong " + "y" * 300, "wrong"),
        ("wrong " + "y" * 300, "wrong"),
        ("y" * 300 + " wrong", "wrong"),
    ],
)
def test_the_caret_is_aligned_with_the_value(text: str, marked: str) -> None:
    report = render([diagnostic(text, marked)])
    lines = report.splitlines()
    line, marks = lines[3], lines[4]
    before = marks.index("^")
    # As many cells before the caret as before the value.
    assert width(line[: line.index(marked)]) == before
    assert marks.count("^") == width(marked)


def test_long_lines_are_truncated() -> None:
    report = render([diagnostic("x" * 50_000 + " wrong " + "y" * 50_000, "wrong")])
    assert max(len(line) for line in report.splitlines()) < 140


@pytest.mark.parametrize(
    ("text", "span", "marks"), [("text: |\n  much", (1, 7, 500), "       ^"), ("", (1, 1, 1), " ^")]
)
def test_marks_end_with_the_line(text: str, span: tuple[int, int, int], marks: str) -> None:
    found = replace(diagnostic("a", "a"), primary=Span(SourceFile("a.yaml", text), *span))
    lines = render([found]).splitlines()[1:5]
    line = text.split("\n", maxsplit=1)[0]
    assert lines == [f" --> a.yaml:1:{span[1]}", "  |", f"1 | {line}".strip(), f"  |{marks}"]


def test_messages_hints_paths_and_labels_are_escaped() -> None:
    nasty = "\x1b[2J\u202e"
    text, label = f"key: {nasty}", Span(SourceFile(f"a{nasty}.yaml", f"key: {nasty}"), 1, 1, 3)
    labels = (Label(label, nasty),)
    found = diagnostic(text, "key", nasty, path=f"b{nasty}.yaml", related=labels, hint=nasty)
    assert not {"\x1b", "\u202e"} & set(render([found]))


def test_color_changes_only_escape_sequences() -> None:
    found = diagnostic("nodes: {talker: 1}", "talker", hint="fix it")
    colored = render([found], color=True)
    assert "\x1b[" in colored
    assert re.sub(r"\x1b\[[0-9;]*m", "", colored) == render([found])


@pytest.mark.parametrize(
    ("severities", "line"),
    [
        ([], "no diagnostics"),
        ([Severity.ERROR], "found 1 error"),
        ([Severity.WARNING, Severity.ERROR] * 2, "found 2 errors, 2 warnings"),
        ([Severity.INFO], "found 1 info"),
        ([Severity.INFO, Severity.WARNING], "found 1 warning, 1 info"),
    ],
)
def test_the_summary_counts(severities: list[Severity], line: str) -> None:
    assert summary(diagnostic("a", "a", made_by=rule(severity)) for severity in severities) == line


def test_of_too_many_diagnostics_the_most_severe_are_shown_in_order() -> None:
    severities = [Severity.INFO, Severity.WARNING, Severity.ERROR, Severity.WARNING, Severity.ERROR]
    found = [
        replace(diagnostic("key: wrong", "wrong"), rule=rule(severity), message=f"number {number}")
        for number, severity in enumerate(severities)
    ]
    report = render(found, maximum=3)
    assert re.findall(r"number (\d)", report) == ["1", "2", "4"]
    assert report.endswith("\n\nfound 2 errors, 2 warnings, 1 info; showing 3 of 5\n")
    assert render(found, maximum=5) == render(found)
