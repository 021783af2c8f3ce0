"""Find values in a tree by the paths of errors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree

_WORDS_FOR_NOTHING = ("null", "~")


@dataclass(frozen=True, slots=True)
class TreeValue:
    """A value in a tree. ``key`` is None for the root and for items of lists."""

    tree: Tree
    key: Scalar | None

    @property
    def owner_span(self) -> Span:
        """The span of the key, or of the value if it has none."""
        return self.key.span if self.key is not None else self.tree.span

    @property
    def value_span(self) -> Span:
        """The span of the value, or of its key if the value is empty."""
        span = self.tree.span
        if self.key is None or not isinstance(self.tree, Scalar) or self.tree.value is not None:
            return span
        written = span.file.line(span.line)[span.column - 1 :]
        return span if written.lower().startswith(_WORDS_FOR_NOTHING) else self.key.span


@dataclass(slots=True)
class TreeIndex:
    """Finds values by path, with an index of the keys of each map."""

    root: Mapping
    _entries: dict[int, dict[str, Entry]] = field(default_factory=dict)

    def find(self, path: Iterable[str | int]) -> TreeValue:
        """Return the value at ``path``, which must exist."""
        place = TreeValue(self.root, None)
        for step in path:
            match place.tree, step:
                case Mapping(), str():
                    entry = self.entries(place.tree)[step]
                    place = TreeValue(entry.value, entry.key)
                case Sequence(), int():
                    place = TreeValue(place.tree.items[step], None)
                case _:
                    raise KeyError(step)
        return place

    def entries(self, tree: Tree) -> dict[str, Entry]:
        """Return the entries of a map by name; none for anything else."""
        if not isinstance(tree, Mapping):
            return {}
        # By identity, since comparing trees is slow; the root keeps them all alive.
        if id(tree) not in self._entries:
            self._entries[id(tree)] = {entry.name: entry for entry in tree}
        return self._entries[id(tree)]
