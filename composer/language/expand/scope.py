"""The names that a file declares, with their values, and in which order to read them."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Map
from dataclasses import field

from composer.base.diagnostics import nearest, shown
from composer.base.fast_dataclass import dataclass
from composer.base.graphs import cycles, strong_groups
from composer.language.expand.arguments import Declared, read_declarations, section_name
from composer.language.schema import kind_of
from composer.language.tree import Mapping, Scalar, Sequence, Tree, count_values

#: Maximum number of comparisons for hints in one file, to limit the time.
_MAX_COMPARISONS = 20_000

#: Maximum number of names in a hint.
_MAX_NAMES = 4


@dataclass(frozen=True, slots=True)
class Sized:
    """A tree without variables, its number of values and its nesting depth."""

    tree: Tree
    values: int
    height: int


@dataclass(slots=True)
class Scope:
    """The names in a file and their values.

    ``section`` declares them. ``values`` are those evaluated so far. A declared name without a
    value, because it was not given or is part of a cycle, stays as written.
    """

    section: str
    declared: dict[str, Declared]
    is_known: bool  # False if the section is malformed, so that the declarations are unknown
    values: dict[str, Sized] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    outer: Scope | None = None
    _compared: int = 0

    @property
    def word(self) -> str:
        """What the file calls a declared name."""
        return self.section.removesuffix("s")

    def inner(self, declared: dict[str, Declared], *, is_known: bool = True) -> Scope:
        """Return a nested scope in which these names take precedence."""
        values = {
            name: measure(variable.value)
            for name, variable in declared.items()
            if variable.value is not None
        }
        return Scope(self.section, declared, self.is_known and is_known, values, outer=self)

    def find(self, name: str) -> Sized | None:
        """Return the value of ``name`` if it is known, and count it as used."""
        if name in self.declared or self.outer is None:
            self.used.add(name)
            return self.values.get(name)
        return self.outer.find(name)

    def use(self, name: str) -> None:
        """Count ``name`` as used."""
        self.find(name)

    def declares(self, name: str) -> bool:
        """Return whether ``name`` is declared."""
        return name in self.declared or (self.outer is not None and self.outer.declares(name))

    def hint(self, name: str) -> str | None:
        """Return the nearest declared name as a hint, or None after too many comparisons.

        That name counts as used.
        """
        if self.outer is not None:
            close = nearest(name, self.declared)
            if close is not None:
                return f"did you mean '{close}'?"
            names = ", ".join(f"'{shown(known)}'" for known in list(self.declared)[:_MAX_NAMES])
            sets = f"'for_each' sets {names}" if names else None
            return self.outer.hint(name) or sets
        self._compared += len(self.declared)
        close = nearest(name, self.declared) if self._compared <= _MAX_COMPARISONS else None
        if close is None:
            return None
        self.used.add(close)
        return f"did you mean '{close}'?"


def read_scope(tree: Mapping) -> Scope:
    """Return the names that a file declares, not yet evaluated."""
    kind = kind_of(tree)
    declared = read_declarations(tree, kind)
    return Scope(section_name(kind), declared or {}, is_known=declared is not None)


def measure(tree: Tree) -> Sized:
    """Return an expanded tree with its size."""
    return Sized(tree, count_values(tree), _height(tree))


def _height(tree: Tree) -> int:
    match tree:
        case Scalar():
            return 0
        case Sequence(items=items):
            return 1 + max(map(_height, items), default=0)
        case Mapping(entries=entries):
            return 1 + max((_height(entry.value) for entry in entries), default=0)


def dependency_order(
    uses: Map[str, Iterable[str]],
) -> tuple[list[str], tuple[tuple[str, ...], ...]]:
    """Return the names, each after those that it uses, and the cycles.

    The order leaves out names on a cycle and names that use them. Of cycles that share names, one
    is returned. The time is linear in the number of uses.
    """
    graph = {name: dict.fromkeys(used for used in uses[name] if used in uses) for name in uses}
    found = cycles(graph)
    order: list[str] = []
    left_out: set[str] = set()
    for group in strong_groups(graph):
        name = group[0]
        if len(group) > 1 or not left_out.isdisjoint(graph[name]) or name in graph[name]:
            left_out.update(group)
        else:
            order.append(name)
    return order, found
