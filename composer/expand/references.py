"""References to variables (``${name}``) in texts."""

from __future__ import annotations

import re
from collections.abc import Iterator

from composer.fast_dataclass import dataclass
from composer.tree import Mapping, Scalar, Sequence, Tree

_MARK = "${"
_PIECE = re.compile(
    r"(?P<literal>\$\$\{)"  # a literal ``${``
    r"|\$\{(?P<name>[A-Za-z_][A-Za-z0-9_]*)\}"
    r"|\$\{[^}]*\}?"  # a malformed reference
)


@dataclass(frozen=True, slots=True)
class Reference:
    """A ``${name}`` and its offset in the text. ``name`` is None if it is malformed."""

    name: str | None
    start: int
    written: str


def pieces(text: str) -> list[str | Reference]:
    """Split ``text`` into texts and references. ``$${`` is a literal ``${``."""
    found: list[str | Reference] = []
    end = 0
    for match in _PIECE.finditer(text):
        found.append(text[end : match.start()])
        if match["literal"] is not None:
            found.append(_MARK)
        else:
            found.append(Reference(match["name"], match.start(), match[0]))
        end = match.end()
    found.append(text[end:])
    return [piece for piece in found if piece != ""]


def has_reference(text: str) -> bool:
    """Return whether ``text`` contains a reference or an escape."""
    return _MARK in text


def references(tree: Tree) -> Iterator[str]:
    """Yield the names that the texts of ``tree`` refer to."""
    match tree:
        case Scalar(value=str() as text) if has_reference(text):
            for piece in pieces(text):
                if isinstance(piece, Reference) and piece.name is not None:
                    yield piece.name
        case Sequence():
            for item in tree.items:
                yield from references(item)
        case Mapping():
            for entry in tree:
                yield from references(entry.key)
                yield from references(entry.value)
