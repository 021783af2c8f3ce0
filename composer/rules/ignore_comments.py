"""Comments that suppress a rule: ``# compose: ignore[rule]``.

A comment applies to its own line or, on a line of its own, to the next line. It suppresses the
diagnostics that have their primary location, or a related one, on that line. Names and codes of
rules are separated by commas; a reason may follow the bracket.

Errors cannot be ignored: a system with errors does not run, and a comment must not start a robot.

"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from itertools import islice

from composer.base.diagnostics import (
    Diagnostic,
    Rule,
    Severity,
    registered_rules,
    shown,
    suggestion,
    warning,
)
from composer.base.fast_dataclass import dataclass
from composer.base.source import SourceFile, Span

UNUSED_IGNORE = warning("RC502", "unused-ignore")

_MARK = "compose:"
_COMMENT = re.compile(r"(?:^|\s)\#[ \t]*(?P<mark>compose:[ \t]*ignore)\b(?:\[(?P<names>[^\]]*)\])?")
#: Rules that the comments of a file may ignore.
_MAX_IGNORES = 500
_NAME = re.compile(r"[^\s,]+")
_ONLY_COMMENT = re.compile(r"\s*(#.*)?$")


@dataclass(frozen=True, slots=True)
class Ignore:
    """A rule, by name or code, that is ignored on a line; ``span`` is its span in the comment.

    The rule is empty if the comment names none.
    """

    rule: str
    line: int
    span: Span

    def matches(self, rule: Rule) -> bool:
        """Return whether ``rule`` is ignored."""
        return self.rule in {rule.name, rule.code}


def without_ignored(
    diagnostics: Iterable[Diagnostic],
    source: SourceFile,
    *,
    complete: bool,
    may_be_needed: Callable[[], bool] = lambda: False,
) -> tuple[list[Diagnostic], set[Span]]:
    """Return the diagnostics that no comment ignores, and the places of the comments that do.

    Unused comments are reported for ``source`` only, and only if ``complete``: if every rule ran.
    With ``may_be_needed()``, a system that is not checked now may need them.
    """
    table = _Table()
    used: set[Span] = set()
    errors: set[Span] = set()
    kept = []
    for diagnostic in diagnostics:
        ignores = {
            ignore.span
            for span in (diagnostic.primary, *(label.span for label in diagnostic.related))
            for ignore in table.at(span)
            if ignore.matches(diagnostic.rule)
        }
        if diagnostic.severity is Severity.ERROR:
            errors |= ignores
        else:
            used |= ignores
        if diagnostic.severity is Severity.ERROR or not ignores:
            kept.append(diagnostic)
    if complete:
        names = tuple(name for rule in registered_rules() for name in (rule.code, rule.name))
        comments = list(ignores_in(source))
        unused = [ignore for ignore in comments[:_MAX_IGNORES] if ignore.span not in used]
        if any(ignore.rule in names for ignore in unused) and may_be_needed():
            unused = [item for item in unused if item.span in errors or item.rule not in names]
        kept += [_unused(ignore, names, is_error=ignore.span in errors) for ignore in unused]
        if len(comments) > _MAX_IGNORES:
            message = f"this file ignores more than {_MAX_IGNORES} rules; the rest has no effect"
            hint = "put 'ignore' into the settings of the project"
            kept.append(Diagnostic(UNUSED_IGNORE, message, comments[-1].span, hint=hint))
    return kept, used


def ignores_in(source: SourceFile) -> Iterator[Ignore]:
    """Yield the rules that the comments of a file ignore, and the first one beyond the limit."""
    return islice(_all_ignores(source), _MAX_IGNORES + 1)


def _all_ignores(source: SourceFile) -> Iterator[Ignore]:
    if _MARK not in source.text:
        return
    waiting: list[tuple[int, re.Match[str]]] = []  # comments about the next line with content
    for number, text in enumerate(source.lines, start=1):
        found = _comment(text) if _MARK in text else None
        if _ONLY_COMMENT.match(text) is None:
            waiting += [] if found is None else [(number, found)]
            yield from _ignores(waiting, number, source)
            waiting.clear()
        elif found is not None:
            waiting.append((number, found))
    yield from _ignores(waiting, len(source.lines), source)


def _comment(line: str) -> re.Match[str] | None:
    """Return the comment of a line: no quote follows, else it may be part of a quoted string."""
    return _COMMENT.search(line, max(line.rfind('"'), line.rfind("'")) + 1)


def _ignores(
    comments: Iterable[tuple[int, re.Match[str]]], line: int, source: SourceFile
) -> Iterator[Ignore]:
    """Yield the rules that ``comments`` ignore on ``line``."""
    for number, comment in comments:
        if not (comment["names"] or "").strip():
            start, end = comment.span("mark")
            yield Ignore("", line, Span(source, number, start + 1, end - start))
        for name in _NAME.finditer(comment.string, *comment.span("names")):
            length = name.end() - name.start()
            yield Ignore(name[0], line, Span(source, number, name.start() + 1, length))


class _Table:
    """The ignored rules by line, for every file with a diagnostic."""

    def __init__(self) -> None:
        self._files: dict[str, dict[int, list[Ignore]]] = {}

    def at(self, span: Span) -> list[Ignore]:
        """Return the rules that are ignored on the line of ``span``."""
        path = span.file.path
        if path not in self._files:
            lines: dict[int, list[Ignore]] = {}
            for ignore in islice(ignores_in(span.file), _MAX_IGNORES):
                lines.setdefault(ignore.line, []).append(ignore)
            self._files[path] = lines
        return self._files[path].get(span.line, [])


def _unused(ignore: Ignore, names: tuple[str, ...], *, is_error: bool) -> Diagnostic:
    if not ignore.rule:
        hint = "write the rule in brackets, as in 'compose: ignore[qos-implicit]'"
        return Diagnostic(UNUSED_IGNORE, "this comment ignores no rule", ignore.span, hint=hint)
    if is_error:
        message = f"'{shown(ignore.rule)}' is an error here"
        return Diagnostic(
            UNUSED_IGNORE, message, ignore.span, hint="errors cannot be ignored; fix it"
        )
    if ignore.rule in names:
        message = f"there is no '{ignore.rule}' to ignore here"
        return Diagnostic(UNUSED_IGNORE, message, ignore.span, hint="remove it")
    message = f"no rule is named '{shown(ignore.rule)}'"
    close = suggestion(ignore.rule, names, limit=0)
    hint = close or "'compose validate --explain RC' lists the rules"
    return Diagnostic(UNUSED_IGNORE, message, ignore.span, hint=hint)
