"""Comments that silence a rule: ``# compose: ignore[rule]``.

One stands behind what it is about, or on a line of its own before it. It holds for the findings
that have their place, or one of the other places they show, on that line. Names and codes of rules
are separated by commas; behind the bracket there may be a reason.

Errors stay: no system runs that has one, and a robot must not start on the word of a comment.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from composer.diagnostics import Diagnostic, Rule, Severity, nearest, register, registered_rules
from composer.source import SourceFile, Span

RULE = register(
    Rule(
        code="RC502",
        name="unused-ignore",
        severity=Severity.WARNING,
        summary="A comment silences nothing: its rule finds nothing there, or an error.",
        why=(
            "The mistake it was about has been mended, or the rule's name is misspelt. Left where "
            "it is, it would hide the next mistake. Errors are not silenced: a system that has one "
            "does not run."
        ),
        bad="""\
system: silence
nodes:
  talker:
    # compose: ignore[unheard-publisher]
    publishers: {chatter: {type: std_msgs/msg/String, qos: command, external: true}}
""",
        good="""\
system: silence
nodes:
  talker:
    # compose: ignore[unheard-publisher] people listen by hand
    publishers: {chatter: {type: std_msgs/msg/String, qos: command}}
""",
    )
)

_MARK = "compose:"
#: A comment, not the end of a quoted text: there is no quote behind it.
_COMMENT = re.compile(r"""(?:^|\s)\#\s*compose:\s*ignore\[(?P<names>[^\]]*)\][^"']*$""")
_NAME = re.compile(r"[^\s,]+")
_ONLY_COMMENT = re.compile(r"\s*(#.*)?$")


@dataclass(frozen=True, slots=True)
class Ignore:
    """A rule, by name or code, that is silenced in a line; ``span`` is its place in the comment."""

    rule: str
    line: int
    span: Span

    def concerns(self, rule: Rule) -> bool:
        """Say whether it is ``rule`` that is silenced."""
        return self.rule in {rule.name, rule.code}


def without_ignored(
    findings: Iterable[Diagnostic], source: SourceFile, *, complete: bool
) -> list[Diagnostic]:
    """Return the findings that no comment silences, and one for each comment that silences none.

    Those are told of ``source`` only, and only when ``complete``: when every rule has had its say.
    """
    table = _Table()
    used: set[Span] = set()
    refused: set[Span] = set()
    kept = []
    for finding in findings:
        ignores = {
            ignore.span
            for span in (finding.primary, *(label.span for label in finding.related))
            for ignore in table.at(span)
            if ignore.concerns(finding.rule)
        }
        if finding.severity is Severity.ERROR:
            refused |= ignores
        else:
            used |= ignores
        if finding.severity is Severity.ERROR or not ignores:
            kept.append(finding)
    if complete:
        useless = (ignore for ignore in ignores_in(source) if ignore.span not in used)
        kept += [_useless(ignore, is_error=ignore.span in refused) for ignore in useless]
    return kept


def ignores_in(source: SourceFile) -> Iterator[Ignore]:
    """Yield what the comments of a file silence."""
    if _MARK not in source.text:
        return
    for number, text in enumerate(source.lines, start=1):
        found = _COMMENT.search(text) if _MARK in text else None
        if found is None:
            continue
        line = _next_line(source, number) if _ONLY_COMMENT.match(text) else number
        for name in _NAME.finditer(text, *found.span("names")):
            length = name.end() - name.start()
            yield Ignore(name[0], line, Span(source, number, name.start() + 1, length))


class _Table:
    """What is silenced in which line, of every file that findings point into."""

    def __init__(self) -> None:
        self._files: dict[str, dict[int, list[Ignore]]] = {}

    def at(self, span: Span) -> list[Ignore]:
        """Return what is silenced in the line of ``span``."""
        path = span.file.path
        if path not in self._files:
            lines: dict[int, list[Ignore]] = {}
            for ignore in ignores_in(span.file):
                lines.setdefault(ignore.line, []).append(ignore)
            self._files[path] = lines
        return self._files[path].get(span.line, [])


def _next_line(source: SourceFile, number: int) -> int:
    """Return the first line behind line ``number`` that is not blank or a comment."""
    behind = range(number + 1, len(source.lines) + 1)
    return next((line for line in behind if not _ONLY_COMMENT.match(source.line(line))), number)


def _useless(ignore: Ignore, *, is_error: bool) -> Diagnostic:
    if is_error:
        message = f"'{ignore.rule}' finds an error here, which no comment silences"
        return Diagnostic(RULE, message, ignore.span, hint="mend it: no system runs that has one")
    names = {name for rule in registered_rules() for name in (rule.code, rule.name)}
    if ignore.rule in names:
        message = f"there is no '{ignore.rule}' to silence here"
        return Diagnostic(RULE, message, ignore.span, hint="remove it")
    close = nearest(ignore.rule, names)
    hint = f"did you mean '{close}'?" if close is not None else "'compose rule' lists the rules"
    return Diagnostic(RULE, f"no rule is called '{ignore.rule}'", ignore.span, hint=hint)
