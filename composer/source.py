"""Where a value was written: the file it stands in and the stretch of text it covers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

T = TypeVar("T")
U = TypeVar("U")


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A text that was read once and is kept, so that diagnostics can quote it.

    ``path`` is the path as people know it (what they typed, or relative to it); two source
    files are equal when their paths are.
    """

    path: str
    text: str = field(default="", repr=False, compare=False)
    lines: tuple[str, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # str.splitlines also splits at form feeds and the like, which YAML does not.
        normalized = self.text.replace("\r\n", "\n").replace("\r", "\n")
        object.__setattr__(self, "lines", tuple(normalized.split("\n")))

    def line(self, number: int) -> str:
        """Return line ``number`` (counted from 1) without its end; empty when there is none."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """A stretch of one line. Lines and columns count from 1, columns and length in characters."""

    file: SourceFile = field(compare=False)
    line: int
    column: int
    length: int = 1

    def part(self, start: int, length: int) -> Span:
        """Return the span that begins ``start`` characters into this one."""
        return Span(self.file, self.line, self.column + start, max(length, 1))

    def __str__(self) -> str:
        return f"{self.file.path}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Located(Generic[T]):
    """A value together with the place it was written at. Equality ignores the place."""

    value: T
    span: Span = field(compare=False)

    def map(self, function: Callable[[T], U]) -> Located[U]:
        """Return ``function`` of the value, at the same place."""
        return Located(function(self.value), self.span)

    def __str__(self) -> str:
        return str(self.value)


def shown_path(path: Path) -> str:
    """Return ``path`` as people know it: relative to the current folder where it is below it."""
    try:
        return str((path.parent.resolve() / path.name).relative_to(Path.cwd()))
    except (OSError, RuntimeError, ValueError):
        return str(path)
