"""Diagnostics: what is wrong and where, with a hint and the rule behind it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator
from enum import Enum
from typing import TypeAlias

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.base.spelling import vocabulary


class Severity(Enum):
    """The severity of a diagnostic. Only errors prevent a system from running."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


_CODE_OR_BAND = re.compile(r"RC\d{1,3}")
_YAML_WORDS = {None: "null", True: "true", False: "false"}

#: Maximum length of a value from a file in a message, in characters.
MAXIMUM_VALUE_LENGTH = 80


@dataclass(frozen=True, slots=True)
class Rule:
    """One kind of problem. The page ``docs/rules/<code>.md`` explains it.

    ``code`` never changes its meaning and is never reused. Bands: 0xx reading, 1xx schema,
    2xx names and references, 3xx types, QoS and wiring, 4xx lifecycle, timers, parameters and
    behaviors, 5xx style and transforms, 9xx internal.
    """

    code: str
    name: str
    severity: Severity

    def matches(self, text: str) -> bool:
        """Return whether ``text`` is the rule's name, its code, or a code prefix (``RC3``)."""
        if text == self.name:
            return True
        return _CODE_OR_BAND.fullmatch(text) is not None and self.code.startswith(text)


@dataclass(frozen=True, slots=True)
class Label:
    """A secondary location of a diagnostic, with a message."""

    span: Span
    message: str


#: A thing that a diagnostic is about, by its kind and name: ``("executor", "motion")``.
Subject: TypeAlias = tuple[str, str]


def line_subject(span: Span) -> Subject:
    """Return the line of a place: all that is reported there."""
    return ("line", f"{span.file.path}:{span.line}")


def errors_subject(span: Span) -> Subject:
    """Return the errors in the file of a place."""
    return ("errors", span.file.path)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """A problem at a location. ``hint`` says how to fix it, in the imperative.

    ``subjects`` are the things that it says are wrong, the most important one first; ``relies_on``
    are those that it takes for right (see :mod:`composer.rules.analysis.subjects`).
    """

    rule: Rule
    message: str
    primary: Span
    related: tuple[Label, ...] = ()
    hint: str | None = None
    subjects: tuple[Subject, ...] = ()
    relies_on: tuple[Subject, ...] = ()

    @property
    def severity(self) -> Severity:
        """The severity of the rule."""
        return self.rule.severity

    @property
    def sort_key(self) -> tuple[str, int, int, str, str]:
        """File, line and column, then code and message, for a reproducible order."""
        span = self.primary
        return (span.file.path, span.line, span.column, self.rule.code, self.message)


_rules: dict[str, Rule] = {}


def register(rule: Rule) -> Rule:
    """Register ``rule`` and return it. Raises ValueError if its code or name is taken."""
    for known in _rules.values():
        if rule.code == known.code or rule.name == known.name:
            raise ValueError(f"rule {rule.code} {rule.name!r} repeats {known.code} {known.name!r}")
    _rules[rule.code] = rule
    return rule


def error(code: str, name: str) -> Rule:
    """Register a rule about what keeps a system from running."""
    return register(Rule(code, name, Severity.ERROR))


def warning(code: str, name: str) -> Rule:
    """Register a rule about what is probably wrong."""
    return register(Rule(code, name, Severity.WARNING))


def info(code: str, name: str) -> Rule:
    """Register a rule about what is only worth knowing."""
    return register(Rule(code, name, Severity.INFO))


def registered_rules() -> Iterator[Rule]:
    """Yield the rules of all modules imported so far, sorted by code."""
    yield from (_rules[code] for code in sorted(_rules))


def in_order(diagnostics: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return the diagnostics sorted by location, without duplicates."""
    # By key, not by equality: spans compare without their file.
    unique: dict[tuple[str, int, int, str, str], Diagnostic] = {}
    for diagnostic in diagnostics:
        unique.setdefault(diagnostic.sort_key, diagnostic)
    return [unique[key] for key in sorted(unique)]


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Return whether any diagnostic is an error."""
    return any(diagnostic.severity is Severity.ERROR for diagnostic in diagnostics)


def shown(value: object, *, limit: int = MAXIMUM_VALUE_LENGTH) -> str:
    """Return ``value`` as text for messages, at most ``limit`` characters long.

    Characters that are invisible or control a terminal are escaped as in Python.
    """
    text = _YAML_WORDS[value] if value is None or isinstance(value, bool) else str(value)
    cut = text if len(text) <= limit else f"{text[: limit - 3]}..."
    if cut.isprintable():
        return cut
    return "".join(
        character if character.isprintable() else repr(character)[1:-1] for character in cut
    )


def nearest(name: str, candidates: Iterable[str]) -> str | None:
    """Return the candidate closest to ``name``, or None."""
    return next(iter(vocabulary(tuple(candidates)).close(name)), None)


def nearest_full_name(name: str, known: Collection[str]) -> str | None:
    """Return the name in the ROS graph closest to ``name``, with its namespace or without."""
    close = nearest(name, known)
    if close is not None:
        return close
    by_last_part = {found.rpartition("/")[2]: found for found in known}
    match = nearest(name.rpartition("/")[2], by_last_part)
    return None if match is None else by_last_part[match]


def suggestion(name: str, candidates: Iterable[str], *, limit: int = 8) -> str | None:
    """Return a hint with the nearest candidate, else a list of at most ``limit``, else None."""
    known = vocabulary(tuple(candidates))
    for close in known.close(name):
        return f"did you mean '{close}'?"
    if not (known.names and limit):
        return None
    listed = ", ".join(map(shown, known.names[:limit]))
    return f"valid here: {listed}" + (", ..." if len(known.names) > limit else "")
