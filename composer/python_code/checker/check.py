"""Runs of the type checker over sets of files, and the findings that matter."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field

from composer.base.diagnostics import nearest
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.copies import Copy, edited_copy
from composer.python_code.checker.file_sets import FileSet, file_sets
from composer.python_code.checker.pyrefly import MISSING_RETURN, SYNTAX_KINDS, Finding, Run, start
from composer.python_code.lookup import BehaviorSource, BrokenModule
from composer.python_code.problems import CheckerFailed, Family, Problem

#: Findings in one file that are read, as each costs time. A real file has a few.
MAX_FINDINGS = 500
#: Checks that run side by side, and the most for one command.
_PARALLEL = 2
_MAXIMUM = 50
_TOO_MANY = f"the type checker reports more than {MAX_FINDINGS} places; the rest is not shown"


@dataclass(slots=True)
class Check:
    """A check that runs in the background."""

    files: FileSet
    _interfaces: Interfaces
    _copies: Mapping[str, Copy]
    _stubs: Mapping[str, str]
    _run: Run

    @classmethod
    def start(cls, files: FileSet, interfaces: Interfaces) -> Check:
        """Start to check files with their stubs. Raises CheckerFailed."""
        copies, texts, stubs = {}, {}, files.stubs(interfaces)
        for name, file in files.files.items():
            texts[name] = file.text.text
            if not isinstance(file.content, BrokenModule):
                copies[name] = edited_copy(file.content, file.node, files.nodes, interfaces)
                texts[name] = copies[name].text
        run = start({**texts, **stubs}, texts, files.search_paths())
        return cls(files, interfaces, copies, stubs, run)

    def close(self) -> None:
        """End the check."""
        self._run.close()

    def problems(self) -> Iterator[tuple[str, Problem]]:
        """Wait for the problems, each with the name of its file. Raises CheckerFailed."""
        findings = self._run.findings()
        yield from self._syntax_problems({x.path for x in findings if x.kind in SYNTAX_KINDS})
        places = self._places(findings)
        if places:
            yield from self._problems(places)

    def _problems(
        self, places: Mapping[str, list[tuple[Finding, Span]]]
    ) -> Iterator[tuple[str, Problem]]:
        """Yield the problems of each file: one of a family in a line, and one of each message."""
        # Most code has no findings, and these modules take 10 ms of each start.
        from composer.python_code.checker.findings import Reader  # noqa: PLC0415 - slow
        from composer.python_code.checker.imports import Owners  # noqa: PLC0415 - slow
        from composer.python_code.checker.relevance import CodeIndex, Relevance, changed_names  # noqa: PLC0415 - slow

        owners = Owners(self._stubs)
        codes = {path: CodeIndex(self._copies[path].module) for path in places}
        attributes = frozenset(name for code in codes.values() for name in code.attributes_set())
        classes = frozenset(name for module in self.files.modules for name in module.classes)
        for path, in_file in places.items():
            file = self.files.files[path]
            changed = changed_names(finding for finding, _ in in_file)
            relevance = Relevance(codes[path], file, owners, changed, attributes, classes)
            seen: set[object] = set()
            wrong_imports: list[str] = []
            for finding, span in in_file[:MAX_FINDINGS]:
                problem = Reader(finding, span, relevance, self._interfaces).problem()
                if problem is None:
                    continue
                keys: set[object] = {(problem.span.line, problem.family)}
                if finding.kind != "missing-import":  # all places of one are shown together
                    keys.add(problem.message)
                text = problem.span.text
                if problem.family is Family.IMPORT:
                    wrong_imports.append(text)
                is_meant = text[:1].isupper() or nearest(text, wrong_imports)
                is_follow_up = problem.family is Family.NAME and wrong_imports and is_meant
                if seen.isdisjoint(keys) and not is_follow_up:
                    yield path, problem
                seen |= keys
            for _, span in in_file[MAX_FINDINGS : MAX_FINDINGS + 1]:
                yield path, Problem(Family.NOT_CHECKED, _TOO_MANY, span)

    def _syntax_problems(self, refused: set[str]) -> Iterator[tuple[str, Problem]]:
        """Yield the files that Python cannot parse, those that the checker can parse as info."""
        for name, file in self.files.files.items():
            if not isinstance(file.content, BrokenModule):
                continue
            problem = Problem(Family.SYNTAX, file.content.message, file.content.span)
            if name not in refused:
                version = ".".join(map(str, sys.version_info[:2]))
                message = f"this Python, {version}, cannot parse the file, which needs a newer one"
                place = problem.span
                problem = Problem(Family.NOT_CHECKED, message, place, "Jazzy's Python is 3.12")
            yield name, problem

    def _places(self, findings: Iterable[Finding]) -> dict[str, list[tuple[Finding, Span]]]:
        """Return the findings by file, with their places in users' files."""
        places: dict[str, list[tuple[Finding, Span]]] = {}
        for finding in findings:
            copy = self._copies.get(finding.path)
            # A missing 'return' is reported at the type of the result, which may be added.
            if copy is not None and (
                finding.message.endswith(MISSING_RETURN)
                or not copy.is_added(finding.line, finding.column)
            ):
                places.setdefault(finding.path, []).append((finding, _span(finding, copy)))
        return places


@dataclass(slots=True)
class RunningCheck:
    """The checks of the classes of a project, some of them running in the background."""

    interfaces: Interfaces
    waiting: list[FileSet]
    running: list[Check] = field(default_factory=list)
    found: list[tuple[Node, BehaviorSource, Problem]] = field(default_factory=list)
    has_failed: bool = False

    def fill(self) -> None:
        """Start as many checks as may run side by side."""
        while self.waiting and len(self.running) < _PARALLEL:
            files = self.waiting.pop(0)
            try:
                self.running.append(Check.start(files, self.interfaces))
            except CheckerFailed as error:
                self._add_failure(files, error)
                self.waiting.clear()  # the next one would fail as well

    def problems(self) -> list[tuple[Node, BehaviorSource, Problem]]:
        """Wait for all checks, and return what they found, each with the node it is about."""
        while self.running:
            check = self.running.pop(0)
            try:
                self._add(check.files, check.problems())
            except CheckerFailed as error:
                self._add_failure(check.files, error)
            self.fill()
        return self.found

    def close(self) -> None:
        """End all checks."""
        self.waiting.clear()
        for check in self.running:
            check.close()

    def _add(self, files: FileSet, found: Iterable[tuple[str, Problem]]) -> None:
        for name, problem in found:
            self.found.append((files.files[name].node, files.files[name].source, problem))

    def _add_failure(self, files: FileSet, error: CheckerFailed) -> None:
        """Report once that the checker does not work, and what is wrong without it."""
        for name, file in files.files.items():
            if isinstance(file.content, BrokenModule):
                problem = Problem(Family.SYNTAX, file.content.message, file.content.span)
                self._add(files, [(name, problem)])
            elif not self.has_failed:
                self.has_failed = True
                message = f"the type checker did not check the Python code: {error}"
                problem = Problem(Family.NOT_CHECKED, message, Span(file.text, 1, 1))
                self._add(files, [(name, problem)])


def start_checks(
    classes: Sequence[tuple[Node, BehaviorSource]], interfaces: Interfaces
) -> RunningCheck:
    """Start to check the classes of nodes; ``problems`` waits for what they find."""
    check = RunningCheck(interfaces, file_sets(classes)[:_MAXIMUM])
    check.fill()
    return check


def _span(finding: Finding, copy: Copy) -> Span:
    """Return the place of a finding in the original file."""
    source = copy.module.source
    line, column = copy.line(finding.line), finding.column
    text = source.line(line)
    end = finding.end_column if finding.end_line == finding.line else len(text) + 1
    return Span(source, line, min(column, len(text) + 1), max(end - column, 1))
