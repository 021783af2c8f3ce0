"""The report for people: every mark stands under what is meant."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from composer.diagnostics import Label, Severity
from composer.report.display import width
from composer.report.text import render, summary
from composer.source import SourceFile, Span
from tests.unit.support.reporting import finding, rule, span_of

PLAIN = """\
error[RC999 made-up]: it is wrong
 --> systems/demo.yaml:1:7
  |
1 | nodes: {talker: 1}
  |       ^
  = hint: mend it

found 1 error
"""


def test_a_finding_shows_its_line_with_a_caret() -> None:
    found = finding("nodes: {talker: 1}", " ", hint="mend it")
    assert render([found]) == PLAIN


@pytest.mark.parametrize(
    ("text", "wanted"),
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
def test_the_caret_is_under_the_value_cell_by_cell(text: str, wanted: str) -> None:
    report = render([finding(text, wanted)])
    lines = report.splitlines()
    line, marks = lines[3], lines[4]
    before = marks.index("^")
    # As many cells before the caret as before the value.
    assert width(line[: line.index(wanted)]) == before
    assert marks.count("^") == width(wanted)


def test_long_lines_are_shown_in_part() -> None:
    report = render([finding("x" * 50_000 + " wrong " + "y" * 50_000, "wrong")])
    assert max(len(line) for line in report.splitlines()) < 140


def test_a_value_longer_than_the_line_is_marked_to_its_end() -> None:
    source = SourceFile("demo.yaml", "text: |\n  much")
    found = replace(finding("a", "a"), primary=Span(source, 1, 7, 500))
    assert marked_cells(render([found])) == 1


def marked_cells(report: str) -> int:
    return report.splitlines()[4].count("^")


def test_a_place_behind_the_end_of_the_text_is_shown() -> None:
    found = replace(finding("a", "a"), primary=Span(SourceFile("empty.yaml", ""), 1, 1, 1))
    assert render([found]).splitlines()[1:5] == [" --> empty.yaml:1:1", "  |", "1 |", "  | ^"]


def test_labels_stand_on_their_own_lines_with_words() -> None:
    source = SourceFile("systems/demo.yaml", "one: 1\ntwo: 2\n")
    other = SourceFile("nodes/planner.yaml", "\n" * 11 + "three: 3")
    found = replace(
        finding("one: 1\ntwo: 2\n", "one"),
        related=(
            Label(span_of(source, "1"), "this value"),
            Label(span_of(other, "three", 12), "declared here"),
        ),
    )
    assert render([found]) == (
        "error[RC999 made-up]: it is wrong\n"
        "  --> systems/demo.yaml:1:1\n"
        "   |\n"
        " 1 | one: 1\n"
        "   | ^^^\n"
        "   |      - this value\n"
        "  ::: nodes/planner.yaml:12:1\n"
        "   |\n"
        "12 | three: 3\n"
        "   | ----- declared here\n"
        "\n"
        "found 1 error\n"
    )


def test_messages_hints_paths_and_labels_are_escaped() -> None:
    nasty = "\x1b[2J\u202e"
    source = SourceFile(f"a{nasty}.yaml", f"key: {nasty}")
    label = Label(Span(source, 1, 1, 3), nasty)
    found = finding(
        f"key: {nasty}", "key", nasty, path=f"b{nasty}.yaml", related=(label,), hint=nasty
    )
    report = render([found])
    assert "\x1b" not in report
    assert "\u202e" not in report


def test_without_colour_there_is_no_escape_and_with_it_the_same_words() -> None:
    found = finding("nodes: {talker: 1}", "talker", hint="mend it")
    coloured = render([found], color=True)
    assert "\x1b[" in coloured
    assert re.sub(r"\x1b\[[0-9;]*m", "", coloured) == render([found])


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
    assert summary(finding("a", "a", made_by=rule(severity)) for severity in severities) == line
