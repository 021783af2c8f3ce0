"""The table ``[tool.composer]`` of a pyproject.toml, as a located tree.

Python's TOML parser returns no locations. This module finds them in the text: each key after its
parent, each
value after its key. The result is right for typical files, and never outside the table.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from composer.diagnostics import Diagnostic, shown
from composer.project.rules import BAD_SETTING
from composer.source import SourceFile, Span
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

TABLE = "[tool.composer]"

_HEADER = re.compile(r"^[ \t]*\[[ \t]*tool[ \t]*\.[ \t]*composer[ \t]*[\].]", re.MULTILINE)
_OTHER_HEADER = re.compile(
    r"^[ \t]*\[(?![ \t]*tool[ \t]*\.[ \t]*composer[ \t]*[\].])[^\n]*\][ \t]*(#|$)", re.MULTILINE
)
_PLACE = re.compile(r"\(at line (\d+), column (\d+)\)$")


def read_table(source: SourceFile) -> tuple[Mapping | None, list[Diagnostic]] | None:
    """Return the table and its TOML errors, or None if there is no such table."""
    header = _HEADER.search(source.text)
    if header is None:
        return None
    import tomllib  # noqa: PLC0415 - most projects have no such table

    try:
        table = tomllib.loads(source.text)["tool"]["composer"]
    except tomllib.TOMLDecodeError as error:
        return None, [_syntax(source, str(error))]
    except (
        KeyError,
        TypeError,
        RecursionError,
    ):  # the header is in a multi-line text, or nested too deep
        return None
    other = _OTHER_HEADER.search(source.text, header.end())
    region = _Region(source, header.start(), len(source.text) if other is None else other.start())
    start = region.span(header.start(), len(TABLE))
    return _mapping(table, region, start), []


def _syntax(source: SourceFile, message: str) -> Diagnostic:
    place = _PLACE.search(message)
    span = Span(source, int(place[1]), int(place[2])) if place else Span(source, 1, 1)
    reason = shown(_PLACE.sub("", message).strip())
    return Diagnostic(BAD_SETTING, f"this is not TOML: {reason}", span)


@dataclass(slots=True)
class _Region:
    """The part of a text that is searched; its start moves behind each match."""

    source: SourceFile
    start: int
    end: int

    def span(self, offset: int, length: int) -> Span:
        """Return the span of ``length`` characters at ``offset``."""
        before = self.source.text[:offset]
        column = offset - (before.rfind("\n") + 1)
        return Span(self.source, before.count("\n") + 1, column + 1, max(length, 1))

    def find(self, pattern: str) -> re.Match[str] | None:
        """Return the first match, and continue after it next time."""
        match = re.compile(pattern).search(self.source.text, self.start, self.end)
        if match is not None:
            self.start = match.end()
        return match

    def rest(self) -> _Region:
        """Return a copy of the remaining region."""
        return _Region(self.source, self.start, self.end)


def _mapping(table: dict[str, Any], region: _Region, span: Span) -> Mapping:
    return Mapping(tuple(_entries(table, region, span)), span)


def _entries(table: dict[str, Any], region: _Region, fallback: Span) -> Iterator[Entry]:
    for name, value in table.items():
        within = region.rest()
        match = within.find(rf"(?<![\w\"'-])[\"']?(?P<key>{re.escape(name)})[\"']?\s*[=.\]]")
        span = within.span(match.start("key"), len(name)) if match is not None else fallback
        key = Scalar(name, span)
        yield Entry(key, _tree(value, within, span))


def _tree(value: Any, region: _Region, fallback: Span) -> Tree:
    match value:
        case dict():
            return _mapping(value, region, fallback)
        case list():
            return Sequence(tuple(_tree(item, region, fallback) for item in value), fallback)
        case bool():
            return Scalar(value, _place(region, "true" if value else "false", fallback))
        case str():
            return Scalar(value, _place(region, rf"[\"']{re.escape(value)}[\"']", fallback))
        case int() | float():
            return Scalar(value, _place(region, r"[-+\w.]+", fallback))
        case _:
            return Scalar(str(value), fallback)


def _place(region: _Region, pattern: str, fallback: Span) -> Span:
    match = region.find(pattern)
    return fallback if match is None else region.span(match.start(), len(match[0]))
