"""Runs a type checker over copies of users' files and maps what it finds back.

The user's files stay as they are and need no annotations: in a copy, a behavior gets the base class
that its node type generates, and handlers and callbacks get annotated arguments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field

from composer.fast_dataclass import dataclass
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.findings import problems_of
from composer.python_code.checker.project import CheckedFile, FileSet, file_sets
from composer.python_code.checker.pyrefly import Check, CheckerFailed, start_check
from composer.python_code.problems import Family, Problem
from composer.python_code.source import BehaviorSource
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
    failures: list[tuple[CheckedFile, str]] = field(default_factory=list)

    def fill(self) -> None:
        """Start as many checks as may run side by side."""
        while self.waiting and len(self.running) < _PARALLEL:
            files = self.waiting.pop(0)
            copies = files.copies()
            texts = {name: item.copy.text for name, item in copies.items()}
            stubs = files.stubs((item.copy for item in copies.values()), self.interfaces)
            try:
                check = start_check({**texts, **stubs}, copies, files.search_paths())
            except CheckerFailed as error:
                self.failures.append((next(iter(copies.values())), str(error)))
                self.waiting.clear()  # the next one would fail as well
                return
            self.running.append((check, copies, files))

    def problems(self) -> list[tuple[Node, BehaviorSource, Problem]]:
        """Wait for all checks, and return what they found, each with the node it is about."""
        found: list[tuple[Node, BehaviorSource, Problem]] = []
        while self.running:
            check, copies, files = self.running.pop(0)
            try:
                findings = check.result()
            except CheckerFailed as error:
                self.failures.append((next(iter(copies.values())), str(error)))
                findings = []
            found += problems_of(findings, copies, files.behaviors, self.interfaces)
            self.fill()
        for item, reason in self.failures[:1]:
            message = f"the type checker did not check the Python code: {reason}"
            span = Span(item.copy.module.source, 1, 1)
            found.append((item.node, item.source, Problem(Family.NOT_CHECKED, message, span)))
        return found

    def close(self) -> None:
        """End all checks."""
        self.waiting.clear()
        for check, _, _ in self.running:
            check.close()


def start(classes: Sequence[tuple[Node, BehaviorSource]], interfaces: Interfaces) -> RunningCheck:
    """Start to check the classes of nodes; ``result`` waits for the findings."""
    check = RunningCheck(interfaces, file_sets(classes, interfaces)[:_MAXIMUM])
    check.fill()
    return check
