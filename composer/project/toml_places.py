"""Where the keys and values of a TOML file are.

Python's TOML parser returns no locations. This module follows the structure of a text, in one pass
and without recursion, and returns the location of each key and value by its path. For a text that
is not TOML, the locations have no meaning.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import field
from enum import Enum, auto
from typing import TypeAlias

from composer.document.limits import MAX_DEPTH
from composer.fast_dataclass import dataclass
from composer.source import SourceFile, Span

#: The keys and, in arrays, the indexes that lead to a value.
Path: TypeAlias = "tuple[str | int, ...]"

_TOKEN = re.compile(
    r'''
    (?P<comment>\#[^\n]*)
    | (?P<string>"""(?:\\.|[^\\])*?"{3,5} | \'\'\'.*?'{3,5} | "(?:\\.|[^"\\])*" | '[^']*')
    | (?P<unclosed>["'].*)
    | (?P<mark>[][{}=,.\n])
    | (?P<bare>[^][{}=,.\n"'\#\s]+)
    ''',
    re.DOTALL | re.VERBOSE,
)


class NestedTooDeep(Exception):
    """A key has more than MAX_DEPTH parts, or arrays and tables are nested deeper."""

    def __init__(self, span: Span) -> None:
        super().__init__(str(span))
        self.span = span


class _State(Enum):
    KEY = auto()
    HEADER = auto()
    VALUE = auto()
    AFTER_VALUE = auto()


@dataclass(frozen=True, slots=True)
class _Token:
    text: str
    start: int
    end: int
    is_mark: bool


@dataclass(slots=True)
class _Open:
    """An array or an inline table that is not complete yet."""

    path: Path
    index: int | None  # None for a table


@dataclass(slots=True)
class Places:
    """The locations of the keys and values of a file, by path."""

    source: SourceFile
    keys: dict[Path, tuple[int, int]] = field(default_factory=dict)
    values: dict[Path, tuple[int, int]] = field(default_factory=dict)
    _line_starts: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self._line_starts = [0, *(match.end() for match in re.finditer("\n", self.source.text))]

    def key(self, path: Path) -> Span | None:
        """Return the location of the key that ends ``path``, or None."""
        return self.span(*self.keys[path]) if path in self.keys else None

    def value(self, path: Path) -> Span | None:
        """Return the location of a value, of the bracket of an array or inline table, or None."""
        return self.span(*self.values[path]) if path in self.values else None

    def span(self, start: int, end: int) -> Span:
        """Return the span of a part of the text, up to the end of its first line."""
        line = bisect_right(self._line_starts, start)
        column = start - self._line_starts[line - 1] + 1
        first_line = self.source.text[start:end].partition("\n")[0].rstrip()
        return Span(self.source, line, column, max(len(first_line), 1))


def find_places(source: SourceFile, below: Path) -> Places:
    """Return the locations of the keys and values at and below the path ``below``.

    Raises NestedTooDeep.
    """
    places = Places(source)
    scanner = _Scanner(places, below)
    for token in _tokens(source.text):
        if scanner.depth > MAX_DEPTH:
            raise NestedTooDeep(places.span(token.start, token.end))
        scanner.handle(token)
    return places


def _tokens(text: str) -> Iterator[_Token]:
    for match in _TOKEN.finditer(text):
        if match.lastgroup != "comment":
            yield _Token(match[0], match.start(), match.end(), match.lastgroup == "mark")


class _Scanner:
    """Follows the structure of a file, without recursion."""

    def __init__(self, places: Places, below: Path) -> None:
        self._places = places
        self._below = below
        self._state = _State.KEY
        self._table: Path = ()  # of the last header
        self._table_counts: dict[Path, int] = {}  # of arrays of tables
        self._open: list[_Open] = []
        self._parts: list[_Token] = []  # of the key that is being read
        self._is_table_array = False
        self._path: Path = ()  # of the value that is being read

    @property
    def depth(self) -> int:
        """The number of open arrays and inline tables, and of parts of the key."""
        return len(self._open) + len(self._parts)

    def handle(self, token: _Token) -> None:
        """Handle the next token."""
        match self._state:
            case _State.KEY:
                self._in_key(token)
            case _State.HEADER:
                self._in_header(token)
            case _State.VALUE:
                self._in_value(token)
            case _State.AFTER_VALUE:
                self._after_value(token)

    def _in_key(self, token: _Token) -> None:
        if not token.is_mark:
            self._parts.append(token)
        elif token.text == "=":
            self._path = self._add_key(self._open[-1].path if self._open else self._table)
            self._state = _State.VALUE
        elif token.text == "[":
            self._state, self._is_table_array = _State.HEADER, False
        elif token.text == "}":
            self._close()

    def _in_header(self, token: _Token) -> None:
        if not token.is_mark:
            self._parts.append(token)
        elif token.text == "[":
            self._is_table_array = True
        elif token.text == "]":
            self._table = self._add_key(())
            if self._is_table_array:
                index = self._table_counts.get(self._table, -1) + 1
                self._table_counts[self._table] = index
                self._table = (*self._table, index)
            self._state = _State.AFTER_VALUE

    def _in_value(self, token: _Token) -> None:
        if token.text == "]" and token.is_mark:  # of an empty array, or behind a last comma
            self._close()
        elif token.text != "\n":
            self._add_value(token)
            if token.is_mark and token.text == "[":
                self._open.append(_Open(self._path, 0))
                self._path = (*self._path, 0)
            elif token.is_mark and token.text == "{":
                self._open.append(_Open(self._path, None))
                self._state = _State.KEY
            else:
                self._state = _State.AFTER_VALUE

    def _after_value(self, token: _Token) -> None:
        inner = self._open[-1] if self._open else None
        if not token.is_mark or token.text == ".":  # such as the rest of 1.5
            self._extend_value(token)
        elif token.text in "]}" and inner is not None:
            self._close()
        elif token.text == "\n" and inner is None:
            self._state = _State.KEY
        elif token.text == "," and inner is not None:
            self._state = _State.KEY if inner.index is None else _State.VALUE
            if inner.index is not None:
                inner.index += 1
                self._path = (*inner.path, inner.index)

    def _close(self) -> None:
        if self._open:
            self._path = self._open.pop().path
        self._state = _State.AFTER_VALUE

    def _add_key(self, path: Path) -> Path:
        """Note the locations of the parts of the key that was read; return its path."""
        for number, part in enumerate(self._parts, start=1):
            path = (*path, _name(part.text))
            if self._is_below(path):
                self._places.keys.setdefault(path, (part.start, part.end))
            # A header within an array of tables is about its last table.
            is_next = self._is_table_array and number == len(self._parts)
            if self._state is _State.HEADER and path in self._table_counts and not is_next:
                path = (*path, self._table_counts[path])
        self._parts.clear()
        return path

    def _add_value(self, token: _Token) -> None:
        if self._is_below(self._path):
            self._places.values[self._path] = (token.start, token.end)

    def _extend_value(self, token: _Token) -> None:
        if self._path in self._places.values:
            self._places.values[self._path] = (self._places.values[self._path][0], token.end)

    def _is_below(self, path: Path) -> bool:
        return path[: len(self._below)] == self._below


def _name(written: str) -> str:
    """Return the text of a key, which may be quoted."""
    if written[0] not in "\"'":
        return written
    if written[0] == "'" or "\\" not in written:
        return written[1:-1]
    import tomllib  # noqa: PLC0415 - keys with escapes are rare

    try:
        return str(tomllib.loads(f"key = {written}")["key"])
    except tomllib.TOMLDecodeError:
        return written
