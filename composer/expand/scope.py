"""The variables of a file: what is declared, what was given, and what each stands for."""

from __future__ import annotations

from dataclasses import dataclass, field

from composer.diagnostics import nearest
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

#: Names compared for hints in one file; more would take longer than all the rest.
_MAX_COMPARISONS = 20_000


@dataclass(frozen=True, slots=True)
class Sized:
    """A tree without variables, the number of values in it and the levels of maps and lists."""

    tree: Tree
    values: int
    height: int


@dataclass(frozen=True, slots=True)
class Declared:
    """A declared variable; ``value`` is None where one must be given."""

    key: Scalar
    value: Tree | None


@dataclass(slots=True)
class Scope:
    """What the names in a file stand for.

    ``values`` are the variables worked out so far. A declared one that is not among them, because
    it was not given or stands on a circle, stays as it is written.
    """

    declared: dict[str, Declared]
    is_known: bool  # false when the section is no map: then nobody knows what is declared
    values: dict[str, Sized] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    outer: Scope | None = None
    _compared: int = 0

    def inner(self, declared: dict[str, Declared], *, is_known: bool = True) -> Scope:
        """Return a scope in which these names stand for something, before those of this one."""
        values = {
            name: measure(variable.value)
            for name, variable in declared.items()
            if variable.value is not None
        }
        return Scope(declared, self.is_known and is_known, values, outer=self)

    def find(self, name: str) -> Sized | None:
        """Return what ``name`` stands for, as far as that is worked out; it counts as used."""
        if name in self.declared or self.outer is None:
            self.used.add(name)
            return self.values.get(name)
        return self.outer.find(name)

    def declares(self, name: str) -> bool:
        """Say whether ``name`` is a variable here."""
        return name in self.declared or (self.outer is not None and self.outer.declares(name))

    def hint(self, name: str) -> str | None:
        """Return the nearest declared name as a hint; none when many were asked for already.

        That name counts as used: it is what was meant.
        """
        if self.outer is not None:
            close = nearest(name, self.declared)
            return self.outer.hint(name) if close is None else f"did you mean '{close}'?"
        self._compared += len(self.declared)
        close = nearest(name, self.declared) if self._compared <= _MAX_COMPARISONS else None
        if close is None:
            return None
        self.used.add(close)
        return f"did you mean '{close}'?"


def read_scope(tree: Mapping, is_node_type: bool) -> Scope:
    """Return the variables that a file declares, nothing being worked out yet.

    A system says what they stand for, a node type what they stand for unless it is told.
    """
    section = tree.get("variables")
    if section is None:
        return Scope({}, is_known=True)
    if not isinstance(section, Mapping):
        return Scope({}, is_known=False)
    read = _default if is_node_type else _value
    return Scope({entry.name: Declared(entry.key, read(entry)) for entry in section}, is_known=True)


def _value(entry: Entry) -> Tree | None:
    return entry.value


def _default(entry: Entry) -> Tree | None:
    return entry.value.get("default") if isinstance(entry.value, Mapping) else None


def measure(tree: Tree) -> Sized:
    """Return a tree that is as it stays, with its size."""
    match tree:
        case Scalar():
            return Sized(tree, 1, 0)
        case Sequence():
            parts = [measure(item) for item in tree.items]
        case Mapping():
            parts = [measure(entry.value) for entry in tree]
    keys = len(parts) if isinstance(tree, Mapping) else 0
    values = 1 + keys + sum(part.values for part in parts)
    return Sized(tree, values, 1 + max((part.height for part in parts), default=0))
