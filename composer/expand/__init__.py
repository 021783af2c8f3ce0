"""Load-time variables: ``${name}`` in a file, and what is put in its place; and copies.

A scalar that is just ``${name}`` becomes the value, whatever it is; inside a text the value's own
text is put in; ``$${`` is a plain ``${``. A declared variable without a value stays as written.
"""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping as Map

from composer.diagnostics import Diagnostic, Label, shown
from composer.expand import rules
from composer.expand.copies import COPYING
from composer.expand.order import dependency_order
from composer.expand.references import references
from composer.expand.scope import Scope, measure, read_scope
from composer.expand.substitution import Substitution, TooLarge
from composer.schema import kind_of
from composer.tree import Entry, Mapping, Scalar, Tree

__all__ = ["expand", "missing_variables"]

_SECTION = "variables"
_LONGEST_CIRCLE = 8  # names told of one


def expand(tree: Mapping, given: Map[str, Tree]) -> tuple[Mapping, list[Diagnostic]]:
    """Return ``tree`` with its variables put in, and what is wrong with them.

    ``given`` goes before what the file itself says: the arguments that a system has for a node
    type, or for a system that it includes. What says ``for_each`` is there as often as it asks for.
    A value that stands for ``${name}`` alone keeps the place where it was written, so that a
    diagnostic points at the argument; a text with values in it keeps its own. The section
    ``variables`` stays as it is. Takes time in proportion to the expanded file, which is bounded.
    """
    scope = read_scope(tree, is_node_type=kind_of(tree) == "node")
    substitution = Substitution(scope)
    diagnostics = list(_unknown_arguments(tree, scope, given))
    try:
        diagnostics += _work_out(substitution, given)
        expanded = _filled(substitution, tree)
    except TooLarge as stopped:
        return tree, [*diagnostics, *substitution.diagnostics, stopped.diagnostic]
    return expanded, [*diagnostics, *substitution.diagnostics, *_unused(scope)]


def missing_variables(tree: Mapping, given: Map[str, Tree]) -> tuple[str, ...]:
    """Return the variables of a node type that have no default and are not ``given``.

    One that was given under a misspelt name is not among them: ``expand`` tells that.
    """
    scope = read_scope(tree, is_node_type=True)
    for name in given:
        if name not in scope.declared:
            scope.hint(name)
    return tuple(
        name
        for name, variable in scope.declared.items()
        if variable.value is None and name not in given and name not in scope.used
    )


def _work_out(substitution: Substitution, given: Map[str, Tree]) -> list[Diagnostic]:
    """Give every variable its value, each after those it uses; return the circles."""
    scope = substitution.scope
    scope.values.update((name, measure(value)) for name, value in given.items())
    own = {
        name: variable.value
        for name, variable in scope.declared.items()
        if variable.value is not None and name not in given
    }
    order, circles = dependency_order({name: set(references(own[name])) for name in own})
    for name in order:
        scope.values[name] = substitution.put_into(own[name])
    return [_circle(circle, scope) for circle in circles]


def _filled(substitution: Substitution, tree: Mapping) -> Mapping:
    """Return the file with variables put in, and its copies made; ``variables`` as it stands."""
    substitution.growth.values = 0
    substitution.grow(1 + len(tree.entries), tree)
    sections = COPYING if kind_of(tree) == "system" else {}

    def filled(entry: Entry) -> Entry:
        if entry.name == _SECTION:
            return entry
        copying = sections.get(entry.name)
        if copying is not None:
            return Entry(entry.key, copying(entry.value, substitution))
        return Entry(entry.key, substitution.add(entry.value, depth=1).tree)

    return Mapping(tuple(filled(entry) for entry in tree), tree.span)


def _unknown_arguments(tree: Mapping, scope: Scope, given: Map[str, Tree]) -> Iterator[Diagnostic]:
    if not scope.is_known:
        return
    name = tree.get(kind_of(tree) or "")
    for argument, value in given.items():
        if argument not in scope.declared:
            owner = f"'{shown(name.value)}'" if isinstance(name, Scalar) else "this file"
            message = f"{owner} has no variable '{shown(argument)}'"
            hint = scope.hint(argument) or "leave it out"
            yield Diagnostic(rules.UNKNOWN_VARIABLE, message, value.span, hint=hint)


def _circle(names: list[str], scope: Scope) -> Diagnostic:
    first, *others = names[:_LONGEST_CIRCLE]
    rest = ["..."] if len(names) > _LONGEST_CIRCLE else []
    written = " -> ".join([*map(shown, (first, *others)), *rest, shown(first)])
    message = f"variable '{shown(first)}' stands for itself: {written}"
    labels = tuple(Label(scope.declared[name].key.span, "by way of this") for name in others)
    span = scope.declared[first].key.span
    return Diagnostic(rules.CYCLIC_VARIABLES, message, span, labels)


def _unused(scope: Scope) -> Iterator[Diagnostic]:
    for variable in scope.declared.values():
        # Of what was not worked out: defaults that an argument replaced, and circles.
        scope.used.update(references(variable.value) if variable.value is not None else ())
    for name, variable in scope.declared.items():
        if name not in scope.used:
            message = f"variable '{shown(name)}' is never used"
            hint = f"use it as '${{{shown(name)}}}', or leave it out"
            yield Diagnostic(rules.UNUSED_VARIABLE, message, variable.key.span, hint=hint)
