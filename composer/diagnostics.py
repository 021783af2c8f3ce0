"""Findings: what is wrong, where, what was expected, and which rule says so."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum

from composer.source import Span
from composer.spelling import vocabulary


class Severity(Enum):
    """How much a finding weighs. Only errors keep a system from running."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


_CODE_OR_BAND = re.compile(r"RC\d{1,3}")
_YAML_WORDS = {None: "null", True: "true", False: "false"}

#: How much of a value from a file is repeated in a message, in characters.
LONGEST_ECHO = 80


@dataclass(frozen=True, slots=True)
class Rule:
    """One thing that can be wrong, with all that ``compose rule`` and the catalogue say of it.

    ``code`` never changes its meaning and is never used again. Bands: 0xx reading, 1xx schema,
    2xx names and references, 3xx types, QoS and wiring, 4xx lifecycle, timers, parameters and
    behaviours, 5xx style, 9xx internal.
    """

    code: str
    name: str
    severity: Severity
    summary: str
    why: str
    bad: str
    good: str

    def is_meant_by(self, text: str) -> bool:
        """Say whether ``text`` is the rule's name, its code, or the beginning of it (``RC3``)."""
        if text == self.name:
            return True
        return _CODE_OR_BAND.fullmatch(text) is not None and self.code.startswith(text)


@dataclass(frozen=True, slots=True)
class Label:
    """A second place that belongs to a finding, and what it has to do with it."""

    span: Span
    message: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One finding. ``hint`` says how to mend it, in the imperative."""

    rule: Rule
    message: str
    primary: Span
    related: tuple[Label, ...] = ()
    hint: str | None = None

    @property
    def severity(self) -> Severity:
        """The severity of the rule behind the finding."""
        return self.rule.severity

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """File, line, column; then code and message, so that any order is reproducible."""
        span = self.primary
        return (span.file.path, span.line, span.column, self.rule.code, self.message)


_rules: dict[str, Rule] = {}


def register(rule: Rule) -> Rule:
    """Add ``rule`` to the catalogue and return it. Raises ValueError when code or name is taken."""
    for known in _rules.values():
        if rule.code == known.code or rule.name == known.name:
            raise ValueError(f"rule {rule.code} {rule.name!r} repeats {known.code} {known.name!r}")
    _rules[rule.code] = rule
    return rule


def registered_rules() -> Iterator[Rule]:
    """Yield the rules of every module imported so far, by code."""
    yield from (_rules[code] for code in sorted(_rules))


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return the findings sorted by place, each once."""
    # By key, not by equality: spans compare without their file.
    unique: dict[tuple[str, int, int, str, str], Diagnostic] = {}
    for diagnostic in diagnostics:
        unique.setdefault(diagnostic.sort_key, diagnostic)
    return [unique[key] for key in sorted(unique)]


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Say whether any finding is an error."""
    return any(diagnostic.severity is Severity.ERROR for diagnostic in diagnostics)


def shown(value: object, *, limit: int = LONGEST_ECHO) -> str:
    """Return ``value`` as messages echo it, no longer than ``limit``.

    Characters that could steer a terminal or hide become escapes, as Python writes them.
    """
    text = _YAML_WORDS[value] if value is None or isinstance(value, bool) else str(value)
    cut = text if len(text) <= limit else f"{text[: limit - 3]}..."
    if cut.isprintable():
        return cut
    return "".join(
        character if character.isprintable() else repr(character)[1:-1] for character in cut
    )


def nearest(name: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate that ``name`` was most likely meant to be, or None."""
    return next(iter(vocabulary(tuple(candidates)).close(name)), None)


def suggestion(name: str, candidates: Iterable[str], *, limit: int = 8) -> str | None:
    """Return a hint: the nearest candidate, else a short list of all, else None."""
    known = vocabulary(tuple(candidates))
    for close in known.close(name):
        return f"did you mean '{close}'?"
    if not known.names:
        return None
    listed = ", ".join(map(shown, known.names[:limit]))
    return f"valid here: {listed}" + (", ..." if len(known.names) > limit else "")
