"""Expand load-time variables (``${name}``) and copies (``for_each``).

A scalar that is only ``${name}`` becomes the value of the variable, of any type. Within a text, the
text of the value is inserted. ``$${`` stands for ``${``. A declared variable without value stays as
written.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from collections.abc import Mapping as Map

from composer.base.diagnostics import Diagnostic, Label, errors_subject, shown
from composer.language import rules
from composer.language.document.limits import Stopped, TooManyErrors
from composer.language.expand.copies import COPYING
from composer.language.expand.scope import Scope, dependency_order, measure, read_scope
from composer.language.expand.substitution import Substitution, references
from composer.language.schema import kind_of
from composer.language.tree import Entry, Mapping, Scalar

__all__ = ["expand", "missing_variables"]

_SECTION = "variables"
_MAX_CYCLE_NAMES = 8  # maximum number of names in a message


def expand(tree: Mapping, given: Map[str, Entry]) -> tuple[Mapping, list[Diagnostic]]:
    """Return ``tree`` with variables and copies expanded, and the diagnostics.

    ``given`` are the arguments of a node type or an included system, by name; they override the
    file's own values. A value in place of a whole ``${name}`` keeps the location where it was
    written, so that a diagnostic points at the argument; a text with inserted values keeps its own
    location. The section ``variables`` stays as it is. The time is linear in the size of the
    result, which is limited.
    """
    scope = read_scope(tree, is_node_type=kind_of(tree) == "node")
    substitution = Substitution(scope)
    unknown = dict(_unknown_arguments(tree, scope, given))
    diagnostics: list[Diagnostic] = []
    try:
        diagnostics += _evaluate(substitution, given)
        expanded = _expand_sections(substitution, tree)
    except TooManyErrors as stopped:
        return tree, stopped.diagnostics
    except Stopped as stopped:
        found = [*unknown.values(), *diagnostics, *substitution.diagnostics]
        return tree, [*found, stopped.diagnostic]
    # What the file uses and does not declare is reported there.
    arguments = [item for name, item in unknown.items() if name not in substitution.unknown]
    found = [*arguments, *diagnostics, *substitution.diagnostics]
    # An unknown variable may be meant to be the unused one.
    is_unknown = any(item.rule is rules.UNKNOWN_VARIABLE for item in found)
    return expanded, found if is_unknown else [*found, *_unused(scope)]


def missing_variables(tree: Mapping, given: Collection[str]) -> tuple[str, ...]:
    """Return the variables of a node type that have no default and are not ``given``.

    A variable that was given under another name is left out: ``expand`` reports it.
    """
    scope = read_scope(tree, is_node_type=True)
    unknown = [name for name in given if name not in scope.declared]
    for name in unknown:
        scope.hint(name)
    missing = _without_value(scope, given)
    return () if len(unknown) == len(missing) == 1 else missing


def _without_value(scope: Scope, given: Collection[str]) -> tuple[str, ...]:
    return tuple(
        name
        for name, variable in scope.declared.items()
        if variable.value is None and name not in given and name not in scope.used
    )


def _evaluate(substitution: Substitution, given: Map[str, Entry]) -> list[Diagnostic]:
    """Evaluate every variable after those it uses. Return diagnostics for cycles."""
    scope = substitution.scope
    scope.values.update((name, measure(entry.value)) for name, entry in given.items())
    own = {
        name: variable.value
        for name, variable in scope.declared.items()
        if variable.value is not None and name not in given
    }
    order, cycles = dependency_order({name: [*references(own[name])] for name in own})
    for name in order:
        scope.values[name] = substitution.evaluate(own[name])
    return [_cycle(cycle, scope) for cycle in cycles]


def _expand_sections(substitution: Substitution, tree: Mapping) -> Mapping:
    """Return the file with variables and copies expanded, except the section ``variables``."""
    substitution.growth.values = 0
    substitution.grow(1 + len(tree.entries), tree)
    sections = COPYING if kind_of(tree) == "system" else {}

    def expanded_entry(entry: Entry) -> Entry:
        if entry.name == _SECTION:
            return entry
        copying = sections.get(entry.name)
        if copying is not None:
            return Entry(entry.key, copying(entry.value, substitution))
        return Entry(entry.key, substitution.add(entry.value, depth=1).tree)

    return Mapping(tuple(expanded_entry(entry) for entry in tree), tree.span)


def _unknown_arguments(
    tree: Mapping, scope: Scope, given: Map[str, Entry]
) -> Iterator[tuple[str, Diagnostic]]:
    if not scope.is_known:
        return
    name = tree.get(kind_of(tree) or "")
    for argument, entry in given.items():
        if argument not in scope.declared:
            owner = f"'{shown(name.value)}'" if isinstance(name, Scalar) else "this file"
            message = f"{owner} has no variable '{shown(argument)}'"
            hint = scope.hint(argument)
            missing = _without_value(scope, given)
            if hint is None and len(missing) == 1:
                hint = f"did you mean '{shown(missing[0])}'?"
            labels = _declared_in(tree) if hint is None else ()
            hint = hint or "remove it"
            problem = Diagnostic(rules.UNKNOWN_VARIABLE, message, entry.key.span, labels, hint)
            yield argument, problem


def _declared_in(tree: Mapping) -> tuple[Label, ...]:
    """Point at the file that lacks a variable: it may be another one than was meant."""
    name = tree.get(kind_of(tree) or "")
    return (Label(name.span, "declared here"),) if name is not None else ()


def _cycle(names: tuple[str, ...], scope: Scope) -> Diagnostic:
    first, *others = names[:_MAX_CYCLE_NAMES]
    rest = ["..."] if len(names) > _MAX_CYCLE_NAMES else []
    written = " -> ".join([*map(shown, (first, *others)), *rest, shown(first)])
    message = f"variable '{shown(first)}' is defined by itself"
    if others:
        message += f": {written}"
    labels = tuple(Label(scope.declared[name].key.span, "through this") for name in others)
    span = scope.declared[first].key.span
    return Diagnostic(rules.CYCLE, message, span, labels)


def _unused(scope: Scope) -> Iterator[Diagnostic]:
    for variable in scope.declared.values():
        # Uses in values that were not evaluated: overridden defaults and cycles.
        scope.used.update(references(variable.value) if variable.value is not None else ())
    for name, variable in scope.declared.items():
        if name not in scope.used:
            message = f"variable '{shown(name)}' is never used"
            hint = f"use it as '${{{shown(name)}}}', or remove it"
            span = variable.key.span
            errors = (errors_subject(span),)
            yield Diagnostic(rules.UNUSED_DECLARATION, message, span, hint=hint, relies_on=errors)
