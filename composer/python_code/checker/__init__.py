"""Runs a type checker over copies of users' files and maps what it finds back.

The user's files stay as they are and need no annotations: in a copy, a behavior gets the base class
that its node type generates, and handlers and callbacks get annotated arguments.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.checker.cache import entry_of, keep_entry, read_entry
from composer.python_code.checker.file_sets import FileSet, file_sets
from composer.python_code.lookup import BehaviorSource, BrokenModule
from composer.python_code.problems import CheckerFailed, Family, Problem

if TYPE_CHECKING:
    from composer.python_code.checker.check import Check

__all__ = ["RunningCheck", "start"]

#: Checks that run side by side, and the most for one command.
_PARALLEL = 2
_MAXIMUM = 50


@dataclass(slots=True)
class RunningCheck:
    """The checks of the classes of a project, some of them running in the background."""

    interfaces: Interfaces
    waiting: list[FileSet]
    running: list[tuple[Check, FileSet, Path]] = field(default_factory=list)
    found: list[tuple[Node, BehaviorSource, Problem]] = field(default_factory=list)
    has_failed: bool = False

    def fill(self) -> None:
        """Start as many checks as may run side by side, of files that have changed."""
        while self.waiting and len(self.running) < _PARALLEL:
            files = self.waiting.pop(0)
            stubs = files.stubs(self.interfaces)
            entry = entry_of(files.state(stubs))
            kept = read_entry(entry, files)
            if kept is not None:
                self._add(files, kept)
                continue
            from composer.python_code.checker.check import Check  # noqa: PLC0415 - slow

            try:
                self.running.append((Check.start(files, stubs, self.interfaces), files, entry))
            except CheckerFailed as error:
                self._add_failure(files, error)
                self.waiting.clear()  # the next one would fail as well

    def problems(self) -> list[tuple[Node, BehaviorSource, Problem]]:
        """Wait for all checks, and return what they found, each with the node it is about."""
        while self.running:
            check, files, entry = self.running.pop(0)
            try:
                found = check.problems()
            except CheckerFailed as error:
                self._add_failure(files, error)
            else:
                keep_entry(entry, found)
                self._add(files, found)
            self.fill()
        return self.found

    def close(self) -> None:
        """End all checks."""
        self.waiting.clear()
        for check, _, _ in self.running:
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


def start(classes: Sequence[tuple[Node, BehaviorSource]], interfaces: Interfaces) -> RunningCheck:
    """Start to check the classes of nodes; ``problems`` waits for what they find."""
    check = RunningCheck(interfaces, file_sets(classes, interfaces)[:_MAXIMUM])
    check.fill()
    return check
