"""Diagnostics in what is there more than once, and in other files than the system's own."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from collections.abc import Mapping as Map
from dataclasses import dataclass, replace

from composer.diagnostics import Diagnostic, Label
from composer.source import Located, Span

_QUOTED = re.compile(r"'([^']*)'")
_BETWEEN_NAMES = re.compile(r"[./\s]+")
_MAX_PLACES = 3  # told of a file that is included again and again


def add_include_labels(
    diagnostics: Iterable[Diagnostic], included: Map[str, tuple[Span, ...]]
) -> list[Diagnostic]:
    """Return the diagnostics, those in included files with the places where these are included."""
    return [
        replace(
            diagnostic,
            related=(*diagnostic.related, *_includes(diagnostic.primary.file.path, included)),
        )
        for diagnostic in diagnostics
    ]


def _includes(path: str, included: Map[str, tuple[Span, ...]]) -> Iterator[Label]:
    """Yield where a file is included, and where the file is that does so, and so on."""
    met: set[str] = set()
    while path in included and path not in met:
        met.add(path)
        spans = included[path]
        places = {str(span): span for span in spans}
        yield from (Label(span, "included here") for span in [*places.values()][:_MAX_PLACES])
        path = spans[0].file.path


def deduplicate(
    diagnostics: Iterable[Diagnostic], names: Iterable[Located[str]]
) -> list[Diagnostic]:
    """Return the diagnostics without those that say of one copy what was said of another.

    ``names`` are those of all nodes; copies are nodes that were made from one and the same entry.
    """
    copies = _Copies.among(names)
    told: dict[tuple[str, str, str], Diagnostic] = {}
    for diagnostic in diagnostics:
        said = copies.without_names(diagnostic)
        told.setdefault((diagnostic.rule.code, str(diagnostic.primary), said), diagnostic)
    return list(told.values())


@dataclass(frozen=True, slots=True)
class _Copies:
    """What copies are called, and what was put before names that were written without it."""

    names: frozenset[str]
    prefixes: tuple[str, ...]

    @classmethod
    def among(cls, names: Iterable[Located[str]]) -> _Copies:
        by_place: dict[str, list[Located[str]]] = {}
        for name in names:
            by_place.setdefault(str(name.span), []).append(name)
        copies = [name for found in by_place.values() if len(found) > 1 for name in found]
        prefixes = dict.fromkeys(map(_prefix, copies))
        return cls(
            frozenset(name.value for name in copies),
            tuple(prefix for prefix in prefixes if prefix),
        )

    def without_names(self, diagnostic: Diagnostic) -> str:
        """Return the message without what differs from copy to copy."""
        if not self.names:
            return diagnostic.message
        if "${" in _written(diagnostic.primary):
            return _QUOTED.sub("''", diagnostic.message)
        return _QUOTED.sub(self._without_name, diagnostic.message)

    def _without_name(self, quoted: re.Match[str]) -> str:
        text = quoted[1]
        if text.startswith(("/", *self.prefixes)):
            return "''"
        is_copy = any(name in self.names for name in _BETWEEN_NAMES.split(text))
        return "''" if is_copy else quoted[0]


def _prefix(name: Located[str]) -> str:
    """Return what stands before the name that was written; empty where another one was."""
    written = _written(name.span).strip("'\"")
    return name.value[: -len(written)] if written and name.value.endswith(written) else ""


def _written(span: Span) -> str:
    return span.file.line(span.line)[span.column - 1 :][: span.length]
