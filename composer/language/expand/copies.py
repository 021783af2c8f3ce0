"""Copies (``for_each``) of nodes, connections and includes.

    camera_${index}:
      for_each: {index: [0, 1, 2]}

Each name takes its values one after the other, in the entry and in the name of the node. Several
names give one copy per combination. A number N stands for the values 0 to N - 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Mapping as Map
from itertools import product
from math import prod

from composer.base.diagnostics import Diagnostic, Label, shown
from composer.language import rules
from composer.language.document.limits import MAX_COPIES
from composer.language.expand.scope import Declared
from composer.language.expand.substitution import Substitution, has_reference, references
from composer.language.tree import Entry, Mapping, Scalar, Sequence, Tree

FOR_EACH = "for_each"

_DIFFERENT = "give 'for_each' values that make the names different"
_DEPTH = 2  # of the entries of a section


def _nodes(section: Tree, substitution: Substitution) -> Tree:
    """Return the copies of the entries of a map, with variables expanded in the keys too."""
    if not isinstance(section, Mapping):
        return substitution.add(section, 1).tree
    substitution.grow(1, section)
    found: dict[str, Entry] = {}
    written: dict[str, Entry] = {}
    for entry in section:
        for copy, body in _copies(entry.value, substitution):
            substitution.grow(1, entry.key)
            key = copy.key(entry.key)
            made = Entry(key, copy.add(body, _DEPTH).tree)
            if made.name in found and has_reference(made.name):
                continue  # a variable in the name is unknown
            if made.name in found:
                substitution.diagnostics.append(
                    _duplicate_name(entry, written[made.name], made.name)
                )
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


#: The sections of a system whose entries can have copies.
COPYING: Map[str, Callable[[Tree, Substitution], Tree]] = {
    "include": _items,
    "nodes": _nodes,
    "connections": _items,
}


def _copies(tree: Tree, substitution: Substitution) -> Iterator[tuple[Substitution, Tree]]:
    """Yield a substitution and the tree to apply it to, for each copy of ``tree``."""
    for_each = tree.entry(FOR_EACH) if isinstance(tree, Mapping) else None
    if for_each is None or not isinstance(tree, Mapping):
        yield substitution, tree
        return
    loops = substitution.add(for_each.value, _DEPTH).tree
    values = _values(loops)
    if values is None:
        # The schema reports the error. The names may have any value.
        names = loops.entries if isinstance(loops, Mapping) else ()
        unknown = {entry.name: Declared(entry.key, None) for entry in names}
        yield substitution.within(substitution.scope.inner(unknown, is_known=False)), tree
        return
    values = [(key, _distinct(choices, substitution.diagnostics)) for key, choices in values]
    substitution.grow_copies(prod(len(choices) for _, choices in values), for_each.value)
    body = Mapping(tuple(entry for entry in tree if entry is not for_each), tree.span)
    for chosen in product(*(choices for _, choices in values)):
        names_and_values = zip((key for key, _ in values), chosen, strict=True)
        declared = {str(key.value): Declared(key, value) for key, value in names_and_values}
        yield substitution.within(substitution.scope.inner(declared)), body


def _values(loops: Tree) -> list[tuple[Scalar, tuple[Tree, ...]]] | None:
    """Return the values of each name, or None if they are malformed."""
    if not isinstance(loops, Mapping) or not loops.entries:
        return None
    found = [(entry.key, _choices(entry.value)) for entry in loops]
    return found if all(choices for _, choices in found) else None


def _distinct(choices: tuple[Tree, ...], diagnostics: list[Diagnostic]) -> tuple[Tree, ...]:
    """Return the values without those that are there twice; each of these is reported once."""
    found: dict[object, Tree] = {}
    for choice in choices:
        value = choice.value if isinstance(choice, Scalar) else None
        earlier = found.setdefault((type(value), value), choice)
        if earlier is choice:
            continue
        message = f"'for_each' has the value '{shown(str(value))}' twice"
        label = Label(earlier.span, "the other one")
        problem = Diagnostic(rules.DUPLICATE_NAME, message, choice.span, (label,), _DIFFERENT)
        if all(str(item.primary) != str(problem.primary) for item in diagnostics):
            diagnostics.append(problem)
    return tuple(found.values())


def _choices(tree: Tree) -> tuple[Tree, ...]:
    match tree:
        case Sequence(items=items) if all(_is_plain(item) for item in items):
            return items
        case Scalar(value=bool()):
            return ()
        case Scalar(value=int() as count) if count > 0:
            # One more than the maximum is enough to exceed it.
            numbers = range(min(count, MAX_COPIES + 1))
            return tuple(Scalar(number, tree.span, verbatim=False) for number in numbers)
        case _:
            return ()


def _is_plain(tree: Tree) -> bool:
    return isinstance(tree, Scalar) and tree.value is not None


def _duplicate_name(entry: Entry, earlier: Entry, name: str) -> Diagnostic:
    """Report a name that was made twice, from the same entry or from two."""
    span = entry.key.span
    loops = entry.value.get(FOR_EACH) if isinstance(entry.value, Mapping) else None
    if entry is earlier and isinstance(loops, Mapping):
        used = set(references(entry.key))
        unused = [f"${{{shown(loop.name)}}}" for loop in loops if loop.name not in used]
        hint = _DIFFERENT
        if unused:
            hint = f"make the names unique: '{'_'.join((shown(entry.name), *unused))}'"
        message = f"copies of this node have the same name, '{shown(name)}'"
        return Diagnostic(rules.DUPLICATE_NAME, message, span, hint=hint)
    label = Label(earlier.key.span, "the other one")
    message = f"two nodes are called '{shown(name)}'"
    return Diagnostic(rules.DUPLICATE_NAME, message, span, (label,), "rename one of them")
