"""Declarations of the arguments of a system, and of the variables of a node type.

For example, in ``arguments``::

    lidar: {choices: [velodyne, ouster], default: velodyne, description: The driver to start.}
    simulation: false

A map declares; any other value is a default. The type is declared, or follows from the default and
the choices. A bool is also written as in launch files: ``True``, ``1``, ``'false'``.

A scope has the names that a file declares with their values, and in which order to read them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Mapping as Map
from dataclasses import field

from composer.base.diagnostics import Diagnostic, Label, nearest, shown, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.graphs import cycles, strong_groups
from composer.language import rules
from composer.language.schema import kind_of
from composer.language.tree import (
    Mapping,
    Scalar,
    Sequence,
    Tree,
    count_values,
    describe,
    is_opaque,
    items,
    plain,
)

#: The section that declares the names of a file, by the kind of the file.
SECTIONS = {"system": "arguments", "node": "variables"}
_SPELLINGS = {"true": True, "1": True, "false": False, "0": False}
#: Any number, unchanged: a default of 1 does not say that 0.5 is wrong.
_NUMBER = "number"
#: Maximum number of comparisons for hints in one file, to limit the time.
_MAX_COMPARISONS = 20_000
#: Maximum number of names in a hint.
_MAX_NAMES = 4


@dataclass(frozen=True, slots=True)
class Declared:
    """A declared name; ``value`` is None if one must be given.

    ``type`` is a type of ROS parameters, ``number``, or empty for any value.
    """

    key: Scalar
    value: Tree | None
    type: str = ""
    choices: tuple[Scalar, ...] = ()
    description: str = ""

    @property
    def alternatives(self) -> tuple[Scalar, ...]:
        """The values that the declaration allows, if it lists them; both values of a bool."""
        if self.choices or self.type != "bool":
            return self.choices
        return tuple(Scalar(value, self.key.span, verbatim=False) for value in (False, True))


def section_name(kind: str | None) -> str:
    """Return the name of the section that declares names in a file of this kind."""
    return SECTIONS.get(kind or "", "arguments")


def read_declarations(tree: Mapping, kind: str | None) -> dict[str, Declared] | None:
    """Return the declarations of a file by name; None if the section is malformed."""
    section = tree.get(section_name(kind))
    if section is None:
        return {}
    if not isinstance(section, Mapping):
        return None
    return {entry.name: _declared(entry.key, entry.value) for entry in section}


def _declared(key: Scalar, written: Tree) -> Declared:
    if not isinstance(written, Mapping):
        return Declared(key, written, _type_of(written))
    default, given = written.get("default"), written.get("type")
    choices = tuple(item for item in items(written.get("choices")) if isinstance(item, Scalar))
    named = given.value if isinstance(given, Scalar) else None
    first = next(iter((*choices, *([] if default is None else [default]))), None)
    kind = named if isinstance(named, str) else _type_of(first)
    typed = [_as_type(item, kind) for item in choices]
    description = written.get("description")
    return Declared(
        key,
        None if default is None else _as_type(default, kind) or default,
        kind,
        tuple(item for item in typed if isinstance(item, Scalar)),
        str(plain(description)) if isinstance(description, Scalar) else "",
    )


def _type_of(tree: Tree | None) -> str:
    match tree:
        case Scalar(value=bool()):
            return "bool"
        case Scalar(value=int() | float()):
            return _NUMBER
        case Scalar(value=str() as text) if not is_opaque(text):
            return "string"
        case _:
            return ""


def typed(tree: Tree, declared: Declared, word: str) -> tuple[Tree, Diagnostic | None]:
    """Return a value as the declared type; the value itself and a diagnostic if it has another.

    ``word`` is what the file calls a declared name.
    """
    if isinstance(tree, Scalar) and isinstance(tree.value, str) and is_opaque(tree.value):
        return tree, None
    name = shown(str(declared.key.value))
    label = Label(declared.key.span, "declared here")
    converted = _as_type(tree, declared.type)
    if converted is None:
        kind = "a number" if declared.type == _NUMBER else f"of type {shown(declared.type)}"
        what = f"'{shown(plain(tree))}'" if isinstance(tree, Scalar) else describe(tree)
        message = f"{word} '{name}' is {kind}, not {what}"
        hint = "write a list: [..., ...]" if declared.type.endswith("_array") else None
        return tree, Diagnostic(rules.WRONG_TYPE, message, tree.span, (label,), hint)
    values = [plain(item) for item in declared.choices]
    if values and plain(converted) not in values:
        text = shown(plain(converted))
        listed = ", ".join(f"'{shown(value)}'" for value in values)
        hint = suggestion(text, map(shown, values), limit=0) or f"use one of {listed}"
        message = f"'{text}' is not a choice of {word} '{name}'"
        return converted, Diagnostic(rules.UNKNOWN_WORD, message, tree.span, (label,), hint)
    return converted, None


def default_problems(declarations: dict[str, Declared], word: str) -> Iterator[Diagnostic]:
    """Yield diagnostics for defaults that have another type than declared, or are no choice."""
    for declared in declarations.values():
        if declared.value is not None:
            _, problem = typed(declared.value, declared, word)
            if problem is not None:
                yield problem


def _as_type(tree: Tree, kind: str) -> Tree | None:
    """Return a value as a type; None if it has another one."""
    element = kind.removesuffix("_array")
    if element != kind:
        converted = [_as_type(item, element) for item in items(tree)]
        if not isinstance(tree, Sequence) or None in converted:
            return None
        return Sequence(tuple(item for item in converted if item is not None), tree.span)
    if kind not in ("bool", "integer", "double", "string", _NUMBER):
        return tree
    return _scalar_as_type(tree, kind) if isinstance(tree, Scalar) else None


def _scalar_as_type(scalar: Scalar, kind: str) -> Scalar | None:
    value = scalar.value
    match kind:
        case "string" if value is not None and not isinstance(value, str):
            return Scalar(scalar.span.text, scalar.span)  # as it is written: 1.10
        case "string":
            return None if value is None else scalar
        case "bool" if isinstance(value, bool):
            return scalar
        case "bool":
            spelled = as_bool(value)
            return None if spelled is None else Scalar(spelled, scalar.span, verbatim=False)
        case "double" if isinstance(value, int) and not isinstance(value, bool):
            return Scalar(float(value), scalar.span, verbatim=False)
        case _:
            numbers = int if kind == "integer" else float if kind == "double" else (int, float)
            return scalar if isinstance(value, numbers) and not isinstance(value, bool) else None


def as_bool(value: object) -> bool | None:
    """Return a value as true or false, spelled as in YAML or in launch files; None for others."""
    if isinstance(value, bool):
        return value
    return _SPELLINGS.get(str(value).strip().lower()) if isinstance(value, str | int) else None


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
