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
    rule: Rule,
    line: int,
    subjects: tuple[Subject, ...] = (),
    relies_on: tuple[Subject, ...] = (),
) -> Diagnostic:
    span = Span(FILE, line, 1, 1)
    return Diagnostic(rule, "", span, subjects=subjects, relies_on=relies_on)


def test_what_relies_on_the_subject_of_another_rule_is_left_out() -> None:
    cause = about(MISSING, 1, subjects=(PORT,))
    consequence = about(UNHEARD, 2, relies_on=(PORT,))
    other = about(UNHEARD, 3, relies_on=(("port", "planner.map"),))
    assert without_consequences([cause, consequence, other]) == [cause, other]
    assert without_consequences([consequence, other]) == [consequence, other]


def test_a_rule_does_not_hide_its_own_reports() -> None:
    both = [about(MISSING, line, subjects=(PORT,), relies_on=(PORT,)) for line in (1, 2)]
    assert without_consequences(both) == both


def test_a_doubtful_file_or_line_hides_all_in_it() -> None:
    cause = about(MISSING, 1, subjects=(("line", "system.yaml:2"),))
    consequence, other = about(UNHEARD, 2), about(UNHEARD, 3)
    assert without_consequences([cause, consequence, other]) == [cause, other]
    in_file = about(MISSING, 1, subjects=(("file", "system.yaml"),))
    assert without_consequences([in_file, consequence, other]) == [in_file]


def test_all_uses_of_what_does_not_exist_are_one_report_of_the_most_severe() -> None:
    mild = about(UNHEARD, 1, subjects=(LIDAR,))
    severe = about(MISSING, 2, subjects=(LIDAR,))
    [report] = joined([mild, severe])
    assert report.rule is MISSING
    assert [label.span.line for label in report.related] == [1]


def test_many_unknown_names_of_one_kind_are_one_report_unless_they_are_misspelled() -> None:
    unknown = [about(MISSING, line, subjects=(("node", f"n{line}"),)) for line in (1, 2, 3)]
    [report] = joined(unknown)
    assert [label.message for label in report.related] == [
        "'n2' is not a node of this system either",
        "'n3' is not a node of this system either",
    ]
    assert joined(unknown[:2]) == unknown[:2]
    meant = [
        about(MISSING, line, subjects=(("node", f"n{line}"), ("node", "node")))
        for line in (1, 2, 3)
    ]
    assert joined(meant) == meant
