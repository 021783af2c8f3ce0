"""``for_each``: a node, a connection or an include that is there several times.

    camera_${index}:
      for_each: {index: [0, 1, 2]}

Each name stands for its values in turn, within the entry and in the name of the node; of several
names there is a copy for every combination. A number stands for the numbers from 0 up to it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Mapping as Map
from itertools import product
from math import prod

from composer.diagnostics import Diagnostic, Label, shown
from composer.document.limits import MAX_COPIES
from composer.expand import rules
from composer.expand.references import has_reference
from composer.expand.scope import Declared
from composer.expand.substitution import Substitution
from composer.tree import Entry, Mapping, Scalar, Sequence, Tree

FOR_EACH = "for_each"

_DEPTH = 2  # of the entries of a section


def _nodes(section: Tree, substitution: Substitution) -> Tree:
    """Return the entries of a map, variables put into their keys as well."""
    if not isinstance(section, Mapping):
        return substitution.add(section, 1).tree
    substitution.grow(1, section)
    found: dict[str, Entry] = {}
    written: dict[str, Entry] = {}
    for entry in section:
        for copy, body in _copies(entry.value, substitution):
            substitution.grow(1, entry.key)
            key = _key(entry.key, copy)
            made = Entry(key, copy.add(body, _DEPTH).tree)
            if made.name in found:
                substitution.diagnostics.append(_twice(entry, written[made.name], made.name))
            else:
                found[made.name], written[made.name] = made, entry
    return Mapping(tuple(found.values()), section.span)


def _items(section: Tree, substitution: Substitution) -> Tree:
    if not isinstance(section, Sequence):
        return substitution.add(section, 1).tree
    substitution.grow(1, section)
    items = tuple(
        copy.add(body, _DEPTH).tree
        for item in section.items
        for copy, body in _copies(item, substitution)
    )
    return Sequence(items, section.span)


#: The sections of a system that have copies in them.
COPYING: Map[str, Callable[[Tree, Substitution], Tree]] = {
    "include": _items,
    "nodes": _nodes,
    "connections": _items,
}


def _copies(tree: Tree, substitution: Substitution) -> Iterator[tuple[Substitution, Tree]]:
    """Yield what puts variables into each copy of ``tree``, and what it is to put them into."""
    asked = tree.entry(FOR_EACH) if isinstance(tree, Mapping) else None
    if asked is None or not isinstance(tree, Mapping):
        yield substitution, tree
        return
    loops = substitution.add(asked.value, _DEPTH).tree
    values = _values(loops)
    if values is None:
        # What is wrong with it the schema says. Its names may stand for anything.
        names = loops.entries if isinstance(loops, Mapping) else ()
        unknown = {entry.name: Declared(entry.key, None) for entry in names}
        yield substitution.within(substitution.scope.inner(unknown, is_known=False)), tree
        return
    substitution.grow_copies(prod(len(choices) for _, choices in values), asked.value)
    body = Mapping(tuple(entry for entry in tree if entry is not asked), tree.span)
    for chosen in product(*(choices for _, choices in values)):
        names_and_values = zip((key for key, _ in values), chosen, strict=True)
        declared = {str(key.value): Declared(key, value) for key, value in names_and_values}
        yield substitution.within(substitution.scope.inner(declared)), body


def _values(loops: Tree) -> list[tuple[Scalar, tuple[Tree, ...]]] | None:
    """Return what each name stands for in turn; None where that is not said as it should be."""
    if not isinstance(loops, Mapping) or not loops.entries:
        return None
    found = [(entry.key, _choices(entry.value)) for entry in loops]
    return found if all(choices for _, choices in found) else None


def _choices(tree: Tree) -> tuple[Tree, ...]:
    match tree:
        case Sequence(items=items) if all(_is_plain(item) for item in items):
            return items
        case Scalar(value=bool()):
            return ()
        case Scalar(value=int() as count) if count > 0:
            # One more than there may be is enough to be told that there are too many.
            numbers = range(min(count, MAX_COPIES + 1))
            return tuple(Scalar(number, tree.span, verbatim=False) for number in numbers)
        case _:
            return ()


def _is_plain(tree: Tree) -> bool:
    return isinstance(tree, Scalar) and tree.value is not None


def _key(key: Scalar, copy: Substitution) -> Scalar:
    """Return the name of a copy, at the place of what it was made from."""
    if not isinstance(key.value, str) or not has_reference(key.value):
        return key
    name = copy.add(key, _DEPTH).tree
    if not isinstance(name, Scalar):
        return key
    text = name.value if isinstance(name.value, str) else shown(name.value)
    return Scalar(text, key.span, verbatim=False)


def _twice(entry: Entry, earlier: Entry, name: str) -> Diagnostic:
    """Say that a name is there already, made from the same entry or from another."""
    span = entry.key.span
    loops = entry.value.get(FOR_EACH) if isinstance(entry.value, Mapping) else None
    if entry is earlier and isinstance(loops, Mapping):
        told_apart = "_".join(f"${{{shown(loop.name)}}}" for loop in loops)
        hint = f"tell them apart: '{shown(entry.name)}_{told_apart}'"
        message = f"copies of this node have the same name, '{shown(name)}'"
        return Diagnostic(rules.DUPLICATE_NODE_NAME, message, span, hint=hint)
    label = Label(earlier.key.span, "the other one")
    message = f"two nodes are called '{shown(name)}'"
    return Diagnostic(rules.DUPLICATE_NODE_NAME, message, span, (label,), "rename one of them")
