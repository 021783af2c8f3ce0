"""The located tree: the content of a YAML file, with the location of every key and value.

Functions read typed values from it, and change values in it. They skip values of the wrong type,
which the schema has already reported.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field
from enum import StrEnum
from typing import TypeAlias, TypeVar

from composer.base.diagnostics import shown
from composer.base.fast_dataclass import dataclass
from composer.base.source import Located, Span

#: A YAML 1.2 core-schema scalar.
ScalarValue: TypeAlias = "bool | int | float | str | None"
#: Plain Python data, as in JSON.
Plain: TypeAlias = "ScalarValue | list[Plain] | dict[str, Plain]"
Tree: TypeAlias = "Scalar | Sequence | Mapping"
E = TypeVar("E", bound=StrEnum)
T = TypeVar("T")
D = TypeVar("D")
#: Placeholder for a missing text. Like any text with a load-time variable without value, it is not
#: checked, so that one mistake gives one diagnostic.
OPAQUE = "${}"


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


def is_opaque(text: str) -> bool:
    """Return whether ``text`` has a load-time variable without value."""
    return "${" in text


def entries(tree: Tree | None) -> tuple[Entry, ...]:
    """Return the entries of a map; none for other values."""
    return tree.entries if isinstance(tree, Mapping) else ()


def mapping(entry: Entry) -> Mapping:
    """Return the map under a key; an empty one for other values."""
    return entry.value if isinstance(entry.value, Mapping) else Mapping((), entry.key.span)


def items(tree: Tree | None) -> tuple[Tree, ...]:
    """Return the items of a list; none for other values."""
    return tree.items if isinstance(tree, Sequence) else ()


def text(tree: Tree | None) -> Located[str] | None:
    """Return a text with its location."""
    if isinstance(tree, Scalar) and isinstance(tree.value, str):
        return Located(tree.value, tree.span)
    return None


def texts(tree: Tree | None) -> tuple[Located[str], ...]:
    """Return a single text, or the texts of a list."""
    found = map(text, tree.items if isinstance(tree, Sequence) else (tree,))
    return tuple(item for item in found if item is not None)


def plain_text(tree: Tree | None) -> str:
    """Return a text without its location; empty by default."""
    return value_or(text(tree), "")


def text_or_opaque(tree: Tree | None, span: Span) -> Located[str]:
    """Return a required text, or a placeholder at ``span``."""
    return text(tree) or Located(OPAQUE, tree.span if tree is not None else span)


def integer(tree: Tree | None) -> Located[int] | None:
    """Return an integer with its location."""
    if (
        isinstance(tree, Scalar)
        and isinstance(tree.value, int)
        and not isinstance(tree.value, bool)
    ):
        return Located(tree.value, tree.span)
    return None


def integers(tree: Tree | None) -> tuple[int, ...]:
    """Return the integers of a list."""
    found = map(integer, items(tree))
    return tuple(item.value for item in found if item is not None)


def number(tree: Tree | None) -> Located[float] | None:
    """Return a number with its location; an integer stays an integer."""
    if isinstance(tree, Scalar) and isinstance(tree.value, int | float):
        return None if isinstance(tree.value, bool) else Located(tree.value, tree.span)
    return None


def choice(tree: Tree | None, kind: type[E]) -> Located[E] | None:
    """Return the member of an enumeration, or None."""
    written = text(tree)
    try:
        return None if written is None else written.map(kind)
    except ValueError:
        return None


def value_or(found: Located[T] | None, default: D) -> T | D:
    """Return a value without its location; ``default`` if there is none."""
    return default if found is None else found.value


def flag(tree: Tree | None, default: D) -> bool | D:
    """Return a boolean; ``default`` for other values."""
    return tree.value if isinstance(tree, Scalar) and isinstance(tree.value, bool) else default


def key(entry: Entry) -> Located[str]:
    """Return the key of an entry with its location."""
    return Located(entry.name, entry.key.span)


def word(tree: Tree) -> str:
    """Return a scalar as a program sees it in its arguments or environment."""
    if not isinstance(tree, Scalar) or tree.value is None:
        return ""
    return str(tree.value).lower() if isinstance(tree.value, bool) else str(tree.value)


def environment(tree: Tree | None) -> tuple[tuple[Located[str], str], ...]:
    """Return the environment variables of a map."""
    return tuple((key(item), word(item.value)) for item in entries(tree))


def changed_at(tree: Mapping, path: tuple[str, ...], change: Callable[[Tree], Tree]) -> Mapping:
    """Return a map with the values at ``path`` changed; ``*`` stands for any key or item."""
    changed = _changed_at(tree, path, change)
    return changed if isinstance(changed, Mapping) else tree


def _changed_at(tree: Tree, path: tuple[str, ...], change: Callable[[Tree], Tree]) -> Tree:
    if not path:
        return change(tree)
    step, rest = path[0], path[1:]
    match tree:
        case Mapping() if step == "*" or tree.entry(step) is not None:
            entries = (
                Entry(entry.key, _changed_at(entry.value, rest, change))
                if step in ("*", entry.name)
                else entry
                for entry in tree
            )
            return Mapping(tuple(entries), tree.span)
        case Sequence() if step == "*":
            return Sequence(
                tuple(_changed_at(item, rest, change) for item in tree.items), tree.span
            )
        case _:
            return tree
