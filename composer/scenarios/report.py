"""Results of scenarios as text, and as JUnit XML for CI."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from composer.base.characters import escape_line, escape_lines
from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.report.text import excerpt, render
from composer.scenarios.runner import Result

#: Characters that XML 1.0 does not allow.
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True, slots=True)
class Case:
    """One run of a scenario in a file, with ``path`` as text for one line.

    ``errors`` are diagnostics of the file, because of which it was not run; ``result`` is then
    None. ``for_s`` is how long the run lasts in the time of the system.
    """

    path: str
    name: str
    for_s: float = 0.0
    result: Result | None = None
    errors: Sequence[Diagnostic] = ()

    @property
    def has_passed(self) -> bool:
        """Whether the run met all expectations."""
        return self.result is not None and not self.result.failures

    @property
    def line(self) -> str:
        """The outcome in one line."""
        if self.result is None:
            return f"ERROR   {self.path}: not run, the file has errors"
        word = "passed" if self.has_passed else "FAILED"
        line = f"{word}  {self.path}: {self.name}, {self.for_s:g} s in {self.result.took_s:.2f} s"
        explored = self.result.explored
        return f"{line}, {explored} variations" if explored else line


def details(case: Case, *, color: bool = False) -> str:
    """Return why a scenario has failed: each expectation, what happened, and the last events."""
    if case.result is None:
        return render(case.errors, color=color).rstrip()
    blocks = [f"{case.path}: {case.name} failed"]
    if case.result.variation:
        blocks.append(case.result.variation)
    for failure in case.result.failures:
        lines = excerpt(failure.span, color=color)
        lines += [f"  expected: {failure.expected}", f"  seen:     {_indented(failure.seen)}"]
        blocks.append("\n".join(lines))
    if case.result.timeline:
        events = map(escape_line, case.result.timeline)
        blocks.append("\n".join(["the last events before:", *events]))
    blocks += case.result.recorded
    if case.result.output:
        lines = escape_lines(case.result.output.rstrip()).split("\n")
        blocks.append("\n".join(["output of the process:", *(f"  | {line}" for line in lines)]))
    return "\n".join(blocks)


def _indented(text: str) -> str:
    return escape_lines(text).replace("\n", "\n            ")


def summary(cases: Sequence[Case], took_s: float) -> str:
    """Return the number of scenarios by outcome."""
    passed = sum(case.has_passed for case in cases)
    errors = sum(case.result is None for case in cases)
    counts = ((passed, "passed"), (len(cases) - passed - errors, "failed"), (errors, "not run"))
    text = ", ".join(f"{count} {word}" for count, word in counts if count)
    return f"{text} in {took_s:.1f} s"


def junit(cases: Sequence[Case], took_s: float) -> str:
    """Return the results as JUnit XML, as CI systems read it."""
    failed = sum(case.result is not None and not case.has_passed for case in cases)
    errors = sum(case.result is None for case in cases)
    counts = {"tests": len(cases), "failures": failed, "errors": errors, "time": took_s}
    attributes = {name: f"{count:.3f}".removesuffix(".000") for name, count in counts.items()}
    suites = ElementTree.Element("testsuites", attributes)
    suite = ElementTree.SubElement(
        suites, "testsuite", {"name": "compose test", **attributes, "skipped": "0"}
    )
    for case in cases:
        took = 0.0 if case.result is None else case.result.took_s
        given = {"classname": case.path, "name": case.name, "file": case.path}
        element = ElementTree.SubElement(suite, "testcase", {**given, "time": f"{took:.3f}"})
        if not case.has_passed:
            first = case.errors[0].message if case.result is None else ""
            if case.result is not None:
                failure = case.result.failures[0]
                first = f"expected {failure.expected}, seen {failure.seen}"
            kind = "error" if case.result is None else "failure"
            child = ElementTree.SubElement(element, kind, {"message": _xml(first)})
            child.text = _xml(details(case))
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _xml(text: str) -> str:
    return _NOT_XML.sub("?", text)
