"""Runs a type checker over copies of users' files and maps what it finds back.

The user's files stay as they are and need no annotations: in a copy, a behavior gets the base class
that its node type generates, and handlers and callbacks get annotated arguments.
"""

from __future__ import annotations

import sys
from collections.abc import Container, Mapping, Sequence
from dataclasses import field

from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.findings import SYNTAX_KINDS, problems_of
from composer.python_code.checker.project import CheckedFile, FileSet, file_sets
from composer.python_code.checker.pyrefly import Check, CheckerFailed, start_check
from composer.python_code.lookup import BehaviorSource
from composer.python_code.problems import Family, Problem
from composer.source import Span

__all__ = ["RunningCheck", "start"]

#: Checks that run side by side, and the most for one command.
_PARALLEL = 2
_MAXIMUM = 50


@dataclass(slots=True)
class RunningCheck:
    """The checks of the classes of a project, some of them running in the background."""

    interfaces: Interfaces
    waiting: list[FileSet]
    running: list[tuple[Check, dict[str, CheckedFile], FileSet]] = field(default_factory=list)
    found: list[tuple[Node, BehaviorSource, Problem]] = field(default_factory=list)

    def fill(self) -> None:
        """Start as many checks as may run side by side."""
        while self.waiting and len(self.running) < _PARALLEL:
            files = self.waiting.pop(0)
            copies = files.copies()
            texts = {name: item.copy.text for name, item in copies.items()}
            texts |= {name: item[0].span.file.text for name, item in files.broken.items()}
            stubs = files.stubs(self.interfaces)
            try:
                check = start_check({**texts, **stubs}, texts, files.search_paths())
            except CheckerFailed as error:
                self._failed(files, copies, error)
                self.waiting.clear()  # the next one would fail as well
                return
            self.running.append((check, copies, files))

    def _failed(
        self, files: FileSet, copies: Mapping[str, CheckedFile], error: CheckerFailed
    ) -> None:
        """Report once that the checker does not work, and what is wrong without it."""
        if copies and not self.found:
            item = next(iter(copies.values()))
            message = f"the type checker did not check the Python code: {error}"
            problem = Problem(Family.NOT_CHECKED, message, Span(item.copy.module.source, 1, 1))
            self.found.append((item.node, item.source, problem))
        self._add_broken(files, files.broken)

    def _add_broken(self, files: FileSet, refused: Container[str]) -> None:
        """Report the files that Python cannot parse, those that the checker can parse as info."""
        for name, (broken, node, source) in files.broken.items():
            problem = Problem(Family.SYNTAX, broken.message, broken.span)
            if name not in refused:
                version = ".".join(map(str, sys.version_info[:2]))
                message = f"this Python, {version}, cannot parse the file, which needs a newer one"
                hint = "Jazzy's Python is 3.12"
                problem = Problem(Family.NOT_CHECKED, message, broken.span, hint)
            self.found.append((node, source, problem))

    def problems(self) -> list[tuple[Node, BehaviorSource, Problem]]:
        """Wait for all checks, and return what they found, each with the node it is about."""
        while self.running:
            check, copies, files = self.running.pop(0)
            try:
                findings = check.result()
            except CheckerFailed as error:
                self._failed(files, copies, error)
            else:
                refused = {item.path for item in findings if item.kind in SYNTAX_KINDS}
                self._add_broken(files, refused)
                self.found += problems_of(findings, copies, files.behaviors, self.interfaces)
            self.fill()
        return self.found

    def close(self) -> None:
        """End all checks."""
        self.waiting.clear()
        for check, _, _ in self.running:
            check.close()


def start(classes: Sequence[tuple[Node, BehaviorSource]], interfaces: Interfaces) -> RunningCheck:
    """Start to check the classes of nodes; ``problems`` waits for what they find."""
    check = RunningCheck(interfaces, file_sets(classes, interfaces)[:_MAXIMUM])
    check.fill()
    return check
