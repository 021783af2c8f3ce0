"""YAML events, from libyaml where PyYAML was built with it, else from PyYAML's own parser.

This reads events only: YAML composers are recursive, and libyaml's crashes the process on deeply
nested input. Events come one by one, so that a consumer can stop the parser early. Their marks
count from 0, spans from 1.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Protocol

import yaml

from composer.base.source import SourceFile, Span

_BLOCK_STYLES = ("|", ">")
_LOADER: type[yaml.SafeLoader | yaml.CSafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class Mark(Protocol):
    """A position in a text, as both parsers give it."""

    @property
    def line(self) -> int:
        """The line, from 0."""

    @property
    def column(self) -> int:
        """The character in the line, from 0."""


def span_at(source: SourceFile, mark: Mark | None, length: int = 1) -> Span:
    """Return the span of ``length`` characters that begins at ``mark``.

    PyYAML's types allow a missing mark, its parsers never return one; the span is then 1:1.
    """
    if mark is None:
        return Span(source, 1, 1, length)
    return Span(source, mark.line + 1, mark.column + 1, length)


def scalar_span(source: SourceFile, event: yaml.ScalarEvent) -> tuple[Span, bool, int]:
    """Return the span of a scalar, whether it is verbatim, and the offset of its content.

    The span of a multi-line scalar ends with its first line.
    """
    begin, end = event.start_mark, event.end_mark
    if begin is None or end is None:
        return span_at(source, begin), False, 0
    row, start = begin.line, begin.column
    line = source.line(row + 1)
    if end.line != row or event.style in _BLOCK_STYLES:
        length = len(line.rstrip()) - start
        verbatim, offset = False, 0
    else:
        stop = end.column
        length = stop - start
        offset = 1 if event.style else 0
        verbatim = line[start + offset : stop - offset] == event.value
    return Span(source, row + 1, start + 1, length if length > 0 else 1), verbatim, offset


def collection_span(start: Span, first: Span, is_flow: bool) -> Span:
    """Return the span of a map or list: its bracket or, in block style, its first item."""
    return start if is_flow else first


def parse_events(text: str) -> Generator[yaml.Event, None, None]:
    """Yield the events of ``text``. Raises yaml.YAMLError; PyYAML's own parser also ValueError."""
    loader = _LOADER(text)
    try:
        while (event := loader.get_event()) is not None:
            yield event
    finally:
        loader.dispose()
