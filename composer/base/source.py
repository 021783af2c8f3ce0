"""Locations of values: source files and spans of text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from pathlib import Path
from typing import Generic, TypeVar

from composer.base.fast_dataclass import dataclass

T = TypeVar("T")
U = TypeVar("U")


@dataclass(frozen=True, slots=True)
class SourceFile:
    """The text of a file, kept so that diagnostics can quote it.

    ``path`` is the path as the user typed it, or relative to that. Source files with the same path
    are equal.
    """

    path: str
    text: str = field(default="", repr=False, compare=False)
    lines: tuple[str, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Unlike YAML, str.splitlines also splits at form feeds and other characters.
        normalized = self.text.replace("\r\n", "\n").replace("\r", "\n")
        object.__setattr__(self, "lines", tuple(normalized.split("\n")))

    def line(self, number: int) -> str:
        """Return line ``number``, counted from 1, without its line break; empty if out of range."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a line. Lines and columns count from 1, columns and length in characters."""

    file: SourceFile = field(compare=False)
    line: int
    column: int
    length: int = 1

    def part(self, start: int, length: int) -> Span:
        """Return the part that begins ``start`` characters into this span."""
        return Span(self.file, self.line, self.column + start, max(length, 1))

    def is_on_line_of(self, other: Span) -> bool:
        """Return whether both begin on the same line of a file."""
        return (self.file.path, self.line) == (other.file.path, other.line)

    @property
    def text(self) -> str:
        """What stands there, without the quotation marks around it."""
        start = self.column - 1
        return self.file.line(self.line)[start : start + self.length].strip("'\"")

    def __str__(self) -> str:
        return f"{self.file.path}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Located(Generic[T]):
    """A value with its location. Equality ignores the location."""

    value: T
    span: Span = field(compare=False)

    def map(self, function: Callable[[T], U]) -> Located[U]:
        """Return ``function`` of the value, with the same location."""
        return Located(function(self.value), self.span)

    def __str__(self) -> str:
        return str(self.value)


def shown_path(path: Path) -> str:
    """Return ``path`` for messages: relative to the current folder if it is below it."""
    try:
        return str((path.parent.resolve() / path.name).relative_to(Path.cwd()))
    except (OSError, RuntimeError, ValueError):
        return str(path)
