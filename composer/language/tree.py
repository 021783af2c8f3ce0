"""The located tree: the content of a YAML file, with the location of every key and value."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from typing import TypeAlias

from composer.base.diagnostics import shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span

#: A YAML 1.2 core-schema scalar.
ScalarValue: TypeAlias = "bool | int | float | str | None"
#: Plain Python data, as in JSON.
Plain: TypeAlias = "ScalarValue | list[Plain] | dict[str, Plain]"


@dataclass(frozen=True, slots=True)
class Scalar:
    """A single value.

    ``verbatim`` is true if the text in the file equals the value, without escapes or folding, so
    that parts of the value have spans. ``content_offset`` is 1 for quoted scalars: the span
    includes the quotes.
    """

    value: ScalarValue
    span: Span = field(compare=False)
    verbatim: bool = field(default=True, compare=False)
    content_offset: int = field(default=0, compare=False)

    def part(self, start: int, length: int) -> Span:
        """Return the span of a part of the value, or of the whole value if it is not verbatim."""
        return self.span.part(start + self.content_offset, length) if self.verbatim else self.span


@dataclass(frozen=True, slots=True)
class Sequence:
    """A list. Its span is its first character or, in block style, its first item."""

    items: tuple[Tree, ...]
    span: Span = field(compare=False)


@dataclass(frozen=True, slots=True)
class Entry:
    """A key and its value."""

    key: Scalar
    value: Tree

    @property
    def name(self) -> str:
        """The key as text."""
        return str(self.key.value)


@dataclass(frozen=True, slots=True)
class Mapping:
    """A map with text keys, in the order of the file. They are unique but in parameter files."""

    entries: tuple[Entry, ...]
    span: Span = field(compare=False)

    def entry(self, name: str) -> Entry | None:
        """Return the entry ``name``, or None."""
        for entry in self.entries:  # called very often: a generator would take twice as long
            if entry.key.value == name:
                return entry
        return None

    def get(self, name: str) -> Tree | None:
        """Return the value under ``name``, or None."""
        for entry in self.entries:
            if entry.key.value == name:
                return entry.value
        return None

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)


Tree: TypeAlias = "Scalar | Sequence | Mapping"


@dataclass(frozen=True, slots=True)
class LeftOut:
    """An entry that is left out, by a condition or an empty ``for_each``, at ``span``.

    ``name`` has a ``*`` for each name of the ``for_each``. ``key`` is that of the cause,
    ``condition`` is the condition as the file has it, and ``include`` an include that is left out.
    """

    section: str
    name: str
    span: Span
    key: str
    condition: str
    include: Tree | None = None


def plain(tree: Tree) -> Plain:
    """Return the tree as plain Python data, without locations."""
    match tree:
        case Scalar():
            return tree.value
        case Sequence():
            return [plain(item) for item in tree.items]
        case Mapping():
            found: dict[str, Plain] = {}
            for entry in tree.entries:  # most values are scalars: these need no call
                value = entry.value
                found[entry.name] = value.value if isinstance(value, Scalar) else plain(value)
            return found


def count_values(tree: Tree) -> int:
    """Return the number of values in ``tree``, with maps and lists; keys count as values."""
    match tree:
        case Scalar():
            return 1
        case Sequence(items=items):
            return 1 + sum(map(count_values, items))
        case Mapping(entries=entries):
            # Most values are scalars: these need no call.
            inner = [entry.value for entry in entries if not isinstance(entry.value, Scalar)]
            return 1 + 2 * len(entries) - len(inner) + sum(map(count_values, inner))


def describe(tree: Tree) -> str:
    """Return what ``tree`` is: ``a map``, ``nothing``, ``the number 5``, ``the string 'abc'``."""
    match tree:
        case Mapping():
            return "a map"
        case Sequence():
            return "a list"
        case Scalar(value=None):
            return "nothing"
        case Scalar(value=bool()):
            return shown(tree.value)
        case Scalar(value=str()):
            return f"the string '{shown(tree.value)}'"
        case Scalar():
            return f"the number {shown(tree.value)}"
