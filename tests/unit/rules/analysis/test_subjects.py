"""What diagnostics are about: consequences and repetitions."""

from __future__ import annotations

from composer.base.diagnostics import Diagnostic, Rule, Severity, Subject
from composer.base.source import SourceFile, Span
from composer.rules.analysis.subjects import joined, without_consequences

FILE = SourceFile("system.yaml", "a\nb\nc\n")
PORT: Subject = ("port", "planner.scan")
LIDAR: Subject = ("node", "lidar")
MISSING = Rule("RC001", "missing", Severity.ERROR)
UNHEARD = Rule("RC002", "unheard", Severity.INFO)


def about(
    rule: Rule, line: int, *subjects: Subject, relies_on: tuple[Subject, ...] = ()
) -> Diagnostic:
    return Diagnostic(rule, "", Span(FILE, line, 1, 1), subjects=subjects, relies_on=relies_on)


def test_what_relies_on_the_subject_of_another_rule_is_left_out() -> None:
    cause = about(MISSING, 1, PORT)
    consequence = about(UNHEARD, 2, relies_on=(PORT,))
    other = about(UNHEARD, 3, relies_on=(("port", "planner.map"),))
    assert without_consequences([cause, consequence, other]) == [cause, other]
    assert without_consequences([consequence, other]) == [consequence, other]
    # A rule does not hide its own reports.
    both = [about(MISSING, line, PORT, relies_on=(PORT,)) for line in (1, 2)]
    assert without_consequences(both) == both


def test_a_doubtful_file_or_line_hides_all_in_it() -> None:
    cause = about(MISSING, 1, ("line", "system.yaml:2"))
    consequence, other = about(UNHEARD, 2), about(UNHEARD, 3)
    assert without_consequences([cause, consequence, other]) == [cause, other]
    in_file = about(MISSING, 1, ("file", "system.yaml"))
    assert without_consequences([in_file, consequence, other]) == [in_file]


def test_all_uses_of_what_does_not_exist_are_one_report_of_the_most_severe() -> None:
    [report] = joined([about(UNHEARD, 1, LIDAR), about(MISSING, 2, LIDAR)])
    assert report.rule is MISSING
    assert [label.span.line for label in report.related] == [1]


def test_many_unknown_names_of_one_kind_are_one_report_unless_they_are_misspelled() -> None:
    unknown = [about(MISSING, line, ("node", f"n{line}")) for line in (1, 2, 3)]
    [report] = joined(unknown)
    assert [label.message for label in report.related] == [
        "'n2' is not a node of this system either",
        "'n3' is not a node of this system either",
    ]
    assert joined(unknown[:2]) == unknown[:2]
    meant = [about(MISSING, line, ("node", f"n{line}"), ("node", "node")) for line in (1, 2, 3)]
    assert joined(meant) == meant
