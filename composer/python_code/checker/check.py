"""One run of the type checker over a set of files, and the findings that matter."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import field

from composer.base.diagnostics import nearest
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.python_code.checker.code_index import CodeIndex
from composer.python_code.checker.copies import Copy, edited_copy
from composer.python_code.checker.file_sets import FileSet
from composer.python_code.checker.findings import MISSING_RETURN, SYNTAX_KINDS, Reader
from composer.python_code.checker.owners import Owners
from composer.python_code.checker.pyrefly import Finding, Process, start_process
from composer.python_code.checker.relevance import Relevance, reassigned
from composer.python_code.lookup import BrokenModule
from composer.python_code.problems import Family, Problem

#: Findings in one file that are read, as each costs time. A real file has a few.
MAX_FINDINGS = 500
_TOO_MANY = f"the type checker reports more than {MAX_FINDINGS} places; the rest is not shown"


@dataclass(slots=True)
class Check:
    """A check that runs in the background."""

    _files: FileSet
    _interfaces: Interfaces
    _copies: Mapping[str, Copy]
    _process: Process
    _unread: list[tuple[str, Span]] = field(default_factory=list)  # first places after the limit

    @classmethod
    def start(cls, files: FileSet, stubs: Mapping[str, str], interfaces: Interfaces) -> Check:
        """Start to check files with their stubs. Raises CheckerFailed."""
        copies, texts = {}, {}
        for name, file in files.files.items():
            texts[name] = file.text.text
            if not isinstance(file.content, BrokenModule):
                edits = files.edits.get(file.content.path, {})
                is_behavior = file.node.behavior is not None
                copies[name] = edited_copy(file.content, edits, is_behavior=is_behavior)
                texts[name] = copies[name].text
        process = start_process({**texts, **stubs}, texts, files.search_paths())
        return cls(files, interfaces, copies, process)

    def close(self) -> None:
        """End the check."""
        self._process.close()

    def problems(self) -> list[tuple[str, Problem]]:
        """Wait for the problems, each with the name of its file. Raises CheckerFailed.

        A line has one report of each family, and a file one of each message.
        """
        findings = self._process.findings()
        owners = Owners(self._files.behaviors, self._interfaces)
        found = list(self._syntax_problems({x.path for x in findings if x.kind in SYNTAX_KINDS}))
        seen: set[tuple[object, ...]] = set()
        wrong_imports: dict[str, list[str]] = {}
        for finding, span, code, relevance in self._relevant(findings, owners):
            path = finding.path
            source = self._files.files[path].source
            problem = Reader(finding, source, code, relevance, owners, span).problem()
            if problem is None:
                continue
            keys: set[tuple[object, ...]] = {(path, problem.span.line, problem.family)}
            if finding.kind != "missing-import":  # all places of one are shown together
                keys.add((path, problem.message))
            if problem.family is Family.IMPORT:
                wrong_imports.setdefault(path, []).append(problem.span.text)
            is_follow_up = problem.family is Family.NAME and _is_meant(
                problem.span.text, wrong_imports.get(path, ())
            )
            if seen.isdisjoint(keys) and not is_follow_up:
                found.append((path, problem))
            seen |= keys
        return found + [
            (path, Problem(Family.NOT_CHECKED, _TOO_MANY, span)) for path, span in self._unread
        ]

    def _syntax_problems(self, refused: set[str]) -> Iterator[tuple[str, Problem]]:
        """Yield the files that Python cannot parse, those that the checker can parse as info."""
        for name, file in self._files.files.items():
            if not isinstance(file.content, BrokenModule):
                continue
            problem = Problem(Family.SYNTAX, file.content.message, file.content.span)
            if name not in refused:
                version = ".".join(map(str, sys.version_info[:2]))
                message = f"this Python, {version}, cannot parse the file, which needs a newer one"
                hint = "Jazzy's Python is 3.12"
                problem = Problem(Family.NOT_CHECKED, message, problem.span, hint)
            yield name, problem

    def _relevant(
        self, findings: Iterable[Finding], owners: Owners
    ) -> Iterator[tuple[Finding, Span, CodeIndex, Relevance]]:
        """Yield the findings that matter, with their places in users' files."""
        by_path: dict[str, list[tuple[Finding, Span]]] = {}
        for finding in findings:
            copy = self._copies.get(finding.path)
            # A missing 'return' is reported at the type of the result, which may be added.
            if copy is not None and (
                finding.message.endswith(MISSING_RETURN)
                or not copy.is_added(finding.line, finding.column)
            ):
                by_path.setdefault(finding.path, []).append((finding, _span(finding, copy)))
        for path, in_file in by_path.items():
            self._unread += ((path, span) for _, span in in_file[MAX_FINDINGS : MAX_FINDINGS + 1])
            del in_file[MAX_FINDINGS:]
        codes = {path: CodeIndex(self._copies[path].module) for path in by_path}
        attributes = frozenset(name for code in codes.values() for name in code.attributes_set())
        classes = frozenset(name for module in self._files.modules for name in module.classes)
        for path, in_file in by_path.items():
            changed = [span.line for finding, span in in_file if finding.kind == "bad-assignment"]
            relevance = Relevance(
                codes[path],
                is_class=self._files.files[path].node.behavior is None,
                reassigned=reassigned(codes[path], changed),
                attributes=attributes,
                classes=classes,
                messages=owners.messages,
            )
            for finding, span in in_file:
                if relevance.keeps(finding, span):
                    yield finding, span, codes[path], relevance


def _is_meant(name: str, wrong: Collection[str]) -> bool:
    """Return whether one of the names that cannot be imported should be ``name``."""
    is_class = name[:1].isupper() and any(other[:1].isupper() for other in wrong)
    return is_class or nearest(name, wrong) is not None


def _span(finding: Finding, copy: Copy) -> Span:
    """Return the place of a finding in the original file."""
    source = copy.module.source
    line, column = copy.line(finding.line), finding.column
    text = source.line(line)
    end = finding.end_column if finding.end_line == finding.line else len(text) + 1
    return Span(source, line, min(column, len(text) + 1), max(end - column, 1))
