"""Expand arguments and variables (``${name}``), copies (``for_each``) and conditions (``if``).

A system declares ``arguments``, a node type ``variables``. A scalar that is only ``${name}``
becomes the value of that name, of any type. Within a text, the text of the value is inserted.
``$${`` stands for ``${``. A declared name without value stays as written.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from collections.abc import Mapping as Map
from typing import NamedTuple

from composer.base.diagnostics import Diagnostic, Label, errors_subject, shown
from composer.base.source import Span
from composer.language import rules
from composer.language.expand.arguments import (
    Scope,
    default_problems,
    dependency_order,
    measure,
    read_scope,
    typed,
)
from composer.language.expand.copies import SECTIONS, expand_section
from composer.language.expand.substitution import Substitution, references
from composer.language.rules import Stopped, TooManyErrors
from composer.language.schema import kind_of
from composer.language.tree import Entry, LeftOut, Mapping, Scalar

__all__ = ["Expanded", "expand", "missing_names", "missing_values"]

_MAX_CYCLE_NAMES = 8  # maximum number of names in a message


class Expanded(NamedTuple):
    """A file with its names expanded, the diagnostics, and the entries that are left out.

    ``values`` is the number of keys and values.
    """

    tree: Mapping
    diagnostics: list[Diagnostic]
    left_out: tuple[LeftOut, ...] = ()
    values: int = 0


def expand(tree: Mapping, given: Map[str, Entry]) -> Expanded:
    """Return ``tree`` with names, copies and conditions expanded.

    ``given`` are the arguments of an included system, of a command line or of a node type, by name;
    they override the defaults. A value in place of a whole ``${name}`` keeps the location where it
    was written, so that a diagnostic points at the argument; a text with inserted values keeps its
    own location. The declarations stay as they are. The time is linear in the size of the result,
    which is limited.
    """
    scope = read_scope(tree)
    substitution = Substitution(scope)
    unknown = dict(_unknown_arguments(tree, scope, given))
    given, diagnostics = _typed(scope, given)
    left_out: list[LeftOut] = []
    try:
        diagnostics += _evaluate(substitution, given)
        expanded = _expand_sections(substitution, tree, left_out)
    except TooManyErrors as stopped:
        return Expanded(tree, stopped.diagnostics)
    except Stopped as stopped:
        problems = [*unknown.values(), *diagnostics, *substitution.diagnostics]
        return Expanded(tree, [*problems, stopped.diagnostic])
    # What the file uses and does not declare is reported there.
    arguments = [item for name, item in unknown.items() if name not in substitution.unknown]
    problems = [*arguments, *diagnostics, *substitution.diagnostics]
    # An unknown variable may be meant to be the unused one.
    if not any(item.rule is rules.UNKNOWN_VARIABLE for item in problems):
        problems += _unused(scope)
    return Expanded(expanded, problems, tuple(left_out), substitution.growth.values)


def missing_names(tree: Mapping, given: Collection[str]) -> tuple[str, ...]:
    """Return the declared names that have no default and are not ``given``.

    A variable that was given under another name is left out: ``expand`` reports it.
    """
    return _missing_names(read_scope(tree), given)


def missing_values(
    tree: Mapping, given: Collection[str], span: Span, owner: str, user: str
) -> Iterator[Diagnostic]:
    """Yield a diagnostic at ``span`` for each of the :func:`missing_names`.

    ``owner`` is what the file declares, ``user`` what gives the values.
    """
    scope = read_scope(tree)
    for name in _missing_names(scope, given):
        message = f"{owner} needs a value for its {scope.word} '{shown(name)}'"
        label = Label(scope.declared[name].key.span, "declared without default")
        hint = f"add '{scope.section}: {{{shown(name)}: ...}}' to the {user}"
        yield Diagnostic(rules.MISSING_VARIABLE, message, span, (label,), hint)


def _missing_names(scope: Scope, given: Collection[str]) -> tuple[str, ...]:
    unknown = [name for name in given if name not in scope.declared]
    for name in unknown:
        scope.hint(name)
    missing = _without_value(scope, given)
    return () if len(unknown) == len(missing) == 1 else missing


def _typed(scope: Scope, given: Map[str, Entry]) -> tuple[dict[str, Entry], list[Diagnostic]]:
    """Return values as their declared types, and diagnostics of them and of the defaults."""
    diagnostics = [*default_problems(scope.declared, scope.word)]
    converted = dict(given)
    for name, entry in given.items():
        if name in scope.declared:
            value, problem = typed(entry.value, scope.declared[name], scope.word)
            if problem is None:
                converted[name] = Entry(entry.key, value)
            else:
                diagnostics.append(problem)
                converted.pop(name)  # the default may be right
    return converted, diagnostics


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


def _expand_sections(substitution: Substitution, tree: Mapping, left_out: list[LeftOut]) -> Mapping:
    """Return the file with its sections expanded, except the declarations."""
    substitution.growth.values = 0
    substitution.grow(1 + len(tree.entries), tree)
    is_system = kind_of(tree) == "system"

    def expanded_entry(entry: Entry) -> Entry:
        if entry.name == substitution.scope.section:
            return entry
        if is_system and entry.name in SECTIONS:
            section = expand_section(entry.name, entry.value, substitution, left_out)
            return Entry(entry.key, section)
        return Entry(entry.key, substitution.add(entry.value, depth=1))

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
            message = f"{owner} has no {scope.word} '{shown(argument)}'"
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
    message = f"{scope.word} '{shown(first)}' is defined by itself"
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
            message = f"{scope.word} '{shown(name)}' is never used"
            hint = f"use it as '${{{shown(name)}}}', or remove it"
            span = variable.key.span
            errors = (errors_subject(span),)
            yield Diagnostic(rules.UNUSED_DECLARATION, message, span, hint=hint, relies_on=errors)
