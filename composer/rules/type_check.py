"""The type checker's findings for the systems that are loaded, as diagnostics of their rules.

The checker runs in the background while the rules of all systems are evaluated. A class that
several systems use in the same way is checked once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, TypeAlias

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Interfaces
from composer.model import Node
from composer.python_code.lookup import BehaviorSource
from composer.python_code.nodes import use_of
from composer.python_code.problems import Family, Problem
from composer.rules.analysis.context import Context
from composer.rules.analysis.subjects import earlier_errors
from composer.rules.python import diagnostic, sources

if TYPE_CHECKING:
    from composer.python_code.checker.check import RunningCheck

#: What the type checker needs to know of the use of a class; equal uses are checked once.
_Use: TypeAlias = tuple[object, ...]
#: Rules about the arguments of a function: names in it, and calls of it, follow from theirs.
_ABOUT_SIGNATURES = frozenset({"handler-signature", "missing-self"})


@dataclass(slots=True)
class TypeCheck:
    """The checks of all classes that some systems use, running in the background."""

    _running: list[RunningCheck] = field(default_factory=list)
    _problems: dict[_Use, list[Problem]] | None = None

    @classmethod
    def of(cls, contexts: Sequence[Context]) -> TypeCheck:
        """Start to check the Python code of the systems."""
        from composer.python_code.checker.check import start_checks  # noqa: PLC0415 - slow

        by_interfaces: dict[int, tuple[Interfaces, dict[_Use, tuple[Node, BehaviorSource]]]] = {}
        for context in contexts:
            key = id(context.interfaces)
            _, classes = by_interfaces.setdefault(key, (context.interfaces, {}))
            for node, source, _ in sources(context):
                classes.setdefault(use_of(node, source), (node, source))
        return cls(
            [
                start_checks(tuple(classes.values()), interfaces)
                for interfaces, classes in by_interfaces.values()
                if classes
            ]
        )

    def diagnostics(self, context: Context, reported: Iterable[Diagnostic]) -> list[Diagnostic]:
        """Wait for the checks, and return what they found in the classes of one system.

        ``reported`` are the diagnostics of the rules. What these are about is not repeated.
        """
        if self._problems is None:
            self._problems = self._collected()
        found = [
            (node, problem, diagnostic(problem, node, source, what, context.interfaces))
            for node, source, what in sources(context)
            for problem in self._problems.get(use_of(node, source), ())
        ]
        without_self = [item for _, problem, item in found if problem.family is Family.SELF]
        others = [*reported, *without_self]
        return without_self + [
            item
            for node, problem, item in found
            if problem.family is not Family.SELF and not _follows(problem, node, context, others)
        ]

    def close(self) -> None:
        """End the checks."""
        for check in self._running:
            check.close()

    def _collected(self) -> dict[_Use, list[Problem]]:
        found: dict[_Use, list[Problem]] = {}
        for check in self._running:
            for node, source, problem in check.problems():
                found.setdefault(use_of(node, source), []).append(problem)
        return found


def _follows(
    problem: Problem, node: Node, context: Context, reported: Sequence[Diagnostic]
) -> bool:
    """Return whether a problem only follows from what a rule has reported already."""
    if problem.family is Family.PORT:
        errors = context.once(earlier_errors)
        if not node.complete or node.name.value in errors.nodes:
            return True  # the port may be declared where the file is wrong
    if problem.family is Family.ARGUMENTS and any(
        item.rule.name in _ABOUT_SIGNATURES
        and (problem.span.text.endswith(item.primary.text) or item.primary.text in problem.message)
        for item in reported
    ):
        return True
    return any(_has_reported(item, problem) for item in reported)


def _has_reported(item: Diagnostic, problem: Problem) -> bool:
    """Return whether a rule has reported the same place, or the signature of its function."""
    if item.rule.name in _ABOUT_SIGNATURES and _is_within_function(problem.span, item.primary):
        return True
    start = problem.span.column - item.primary.column
    return problem.span.is_on_line_of(item.primary) and 0 <= start < item.primary.length


def _is_within_function(span: Span, signature: Span) -> bool:
    """Return whether a place is in the function whose signature is at another one."""
    if span.file.path != signature.file.path or span.line < signature.line:
        return False
    lines = span.file.lines[signature.line : span.line]
    depth = _indentation(span.file.line(signature.line))
    return all(_indentation(line) > depth for line in lines if line.strip())


def _indentation(line: str) -> int:
    return len(line) - len(line.lstrip())
