"""Reading a located tree leniently: what has the right shape is taken, the rest is left out.

The schema has already said what is wrong with the rest.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TypeVar

from composer.source import Located, Span
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

E = TypeVar("E", bound=StrEnum)

#: Stands for a text that must be there and is not. Like every text with a load-time variable left
#: in it, it is judged by nobody, so that one mistake makes one diagnostic.
OPAQUE = "${}"


def is_opaque(text: str) -> bool:
    """Say whether a load-time variable without value is left in ``text``."""
    return "${" in text


def entries(tree: Tree | None) -> tuple[Entry, ...]:
    """Return the entries of a map; none when it is not one."""
    return tree.entries if isinstance(tree, Mapping) else ()


def text(tree: Tree | None) -> Located[str] | None:
    """Return a text with its place."""
    if isinstance(tree, Scalar) and isinstance(tree.value, str):
        return Located(tree.value, tree.span)
    return None


def texts(tree: Tree | None) -> tuple[Located[str], ...]:
    """Return one text, or those of a list."""
    items = tree.items if isinstance(tree, Sequence) else (tree,)
    found = (text(item) for item in items)
    return tuple(item for item in found if item is not None)


def plain_text(tree: Tree | None) -> str:
    """Return a text without its place; empty when there is none."""
    found = text(tree)
    return found.value if found is not None else ""


def text_or_opaque(tree: Tree | None, span: Span) -> Located[str]:
    """Return a text that must be there; ``span`` is where it is missing."""
    return text(tree) or Located(OPAQUE, tree.span if tree is not None else span)


def integer(tree: Tree | None) -> Located[int] | None:
    """Return a whole number with its place."""
    if (
        isinstance(tree, Scalar)
        and isinstance(tree.value, int)
        and not isinstance(tree.value, bool)
    ):
        return Located(tree.value, tree.span)
    return None


def number(tree: Tree | None) -> Located[float] | None:
    """Return a number with its place; a whole number stays one."""
    if isinstance(tree, Scalar) and isinstance(tree.value, int | float):
        return None if isinstance(tree.value, bool) else Located(tree.value, tree.span)
    return None


def choice(tree: Tree | None, kind: type[E]) -> Located[E] | None:
    """Return the member of an enumeration that is written there; None for what is none of it."""
    written = text(tree)
    known = {item.value: item for item in kind}
    if written is None or written.value not in known:
        return None
    return written.map(known.__getitem__)


def flag(tree: Tree | None, default: bool) -> bool:
    """Return true or false; ``default`` when it is neither."""
    return tree.value if isinstance(tree, Scalar) and isinstance(tree.value, bool) else default


def key(entry: Entry) -> Located[str]:
    """Return the key of an entry with its place."""
    return Located(entry.name, entry.key.span)
