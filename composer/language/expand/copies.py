"""Copies (``for_each``) and conditions of the entries of a system.

    camera_${index}:
      for_each: {index: [0, 1, 2]}

Each name takes its values one after the other, in the entry and in its name. Several names give one
copy per combination. A number N stands for the values 0 to N - 1; without values, there is no copy.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from collections.abc import Mapping as Map
from dataclasses import replace
from itertools import product
from math import prod

from composer.base.diagnostics import Diagnostic, Label, shown
from composer.base.source import Span
from composer.language import rules
from composer.language.expand.arguments import Declared, as_bool
from composer.language.expand.substitution import Substitution, has_reference, pieces, references
from composer.language.expressions import EvaluationError, ExpressionError, compile_expression
from composer.language.rules import MAX_COPIES
from composer.language.tree import (
    Entry,
    LeftOut,
    Mapping,
    Scalar,
    Sequence,
    Tree,
    describe,
    plain,
    word,
)

CONDITIONS = ("if", "unless")
_WHOLE = re.compile(r"\$\{([^{}]*)\}")
FOR_EACH = "for_each"
_DIFFERENT = "give 'for_each' values that make the names different"
_DEPTH = 2  # of the entries of a section
#: The sections of a system whose entries can have copies and conditions, and what an entry is.
SECTIONS: Map[str, str] = {
    "include": "include",
    "nodes": "node",
    "connections": "connection",
    "executors": "executor",
    "processes": "process",
    "hosts": "host",
    "chains": "chain",
}


def without_conditions(tree: Tree) -> Tree:
    """Return an entry of a section without its conditions."""
    if not isinstance(tree, Mapping) or not any(entry.name in CONDITIONS for entry in tree):
        return tree
    kept = tuple(entry for entry in tree if entry.name not in CONDITIONS)
    return Mapping(kept, tree.span)


def failed_condition(tree: Tree, substitution: Substitution) -> Entry | None:
    """Return the condition that leaves out an entry; None if the entry stays.

    An entry stays as well if its condition cannot be evaluated.
    """
    if not isinstance(tree, Mapping):
        return None
    failed = None
    for entry in tree:
        if entry.name in CONDITIONS:
            holds = _holds(entry.value, substitution)
            if holds is not None and holds != (entry.name == "if"):
                failed = failed or entry
    if failed is not None:
        for name in references(tree):  # uses that are not evaluated
            substitution.scope.use(name)
    return failed


def _holds(written: Tree, substitution: Substitution) -> bool | None:
    """Return whether a condition holds; None if it is not known, or wrong and reported."""
    if not isinstance(written, Scalar) or not isinstance(written.value, str):
        value = plain(written)
        if isinstance(value, bool):
            return value
        _report(substitution, written.span, f"a condition is not {describe(written)}")
        return None
    source, start = _source(written.value)
    if has_reference(source):
        names = _WHOLE.sub(r"\1", written.value)
        hint = f"write the names alone: {shown(names)}"
        message = "a condition is an expression of names, without '${...}' in it"
        _report(substitution, written.span, message, hint)
        return None
    return _evaluated(source, start, written, substitution)


def _source(text: str) -> tuple[str, int]:
    """Return the expression of a condition, and its offset: ``${x}`` is the same as ``x``."""
    whole = _WHOLE.fullmatch(text.strip())
    return (text, 0) if whole is None else (whole[1], text.index("${") + len("${"))


def _evaluated(source: str, start: int, written: Scalar, substitution: Substitution) -> bool | None:
    try:
        expression = compile_expression(source)
    except ExpressionError as error:
        span = written.part(start + error.offset, error.length)
        _report(substitution, span, error.message, error.hint)
        return None
    values = {}
    for path in expression.paths:
        span = written.part(start + path.offset, len(path.root))
        found = substitution.lookup(path.root, written, span)
        if found is not None:
            values[path.root] = plain(found.tree)
    if any(path.root not in values for path in expression.paths):
        return None
    try:
        value = expression.evaluate(values)
    except EvaluationError as error:
        _report(substitution, written.span, str(error))
        return None
    holds = as_bool(value)
    if holds is None:
        hint = f"compare it: {source.strip()} == '{shown(value)}'"
        message = f"'{shown(source.strip())}' is '{shown(value)}', not true or false"
        _report(substitution, written.span, message, hint if isinstance(value, str) else None)
    return holds


def _report(substitution: Substitution, span: Span, message: str, hint: str | None = None) -> None:
    substitution.diagnostics.append(Diagnostic(rules.MALFORMED_VARIABLE, message, span, hint=hint))


def expand_section(
    name: str, section: Tree, substitution: Substitution, left_out: list[LeftOut]
) -> Tree:
    """Return a section with its copies, without the entries that are left out.

    Variables are expanded, in keys too.
    """
    match section:
        case Mapping():
            return _named_entries(name, section, substitution, left_out)
        case Sequence():
            return _items(name, section, substitution, left_out)
        case _:
            return substitution.add(section, 1)


def _named_entries(
    section_name: str, section: Mapping, substitution: Substitution, left_out: list[LeftOut]
) -> Tree:
    substitution.grow(1, section)
    made: dict[str, Entry] = {}
    written: dict[str, Entry] = {}
    for entry in section:
        copies = _copies(entry.value, substitution)
        if not copies:
            left_out.append(_without_copies(section_name, entry))
        for copy, body in copies:
            substitution.grow(1, entry.key)
            key = copy.key(entry.key)
            failed = failed_condition(body, copy)
            if failed is not None:
                left_out.append(_left_out(section_name, str(key.value), failed))
                continue
            new = Entry(key, copy.add(without_conditions(body), _DEPTH))
            if new.name in made and has_reference(new.name):
                continue  # a variable in the name is unknown
            if new.name in made:
                noun = SECTIONS[section_name]
                problem = _duplicate_name(noun, entry, written[new.name], new.name)
                substitution.diagnostics.append(problem)
            else:
                made[new.name], written[new.name] = new, entry
    return Mapping(tuple(made.values()), section.span)


def _items(
    section_name: str, section: Sequence, substitution: Substitution, left_out: list[LeftOut]
) -> Tree:
    substitution.grow(1, section)
    made = []
    for item in section.items:
        copies = _copies(item, substitution)
        prefix = item.get("prefix") if isinstance(item, Mapping) else None
        if not copies and isinstance(prefix, Scalar):  # the names of the nodes of an include
            named = _without_copies("nodes", Entry(prefix, item))
            left_out.append(replace(named, name=f"{named.name}*"))
        for copy, body in copies:
            failed = failed_condition(body, copy)
            if failed is None:
                made.append(copy.add(without_conditions(body), _DEPTH))
            elif section_name == "include":
                include = copy.add(without_conditions(body), _DEPTH)
                left_out.append(replace(_left_out(section_name, "", failed), include=include))
    return Sequence(tuple(made), section.span)


def _left_out(section: str, name: str, condition: Entry) -> LeftOut:
    text = word(condition.value)
    return LeftOut(section, name, condition.key.span, condition.name, text)


def _without_copies(section: str, entry: Entry) -> LeftOut:
    """Return an entry whose ``for_each`` has no values, with a pattern for its names."""
    parts = pieces(entry.name)
    name = "".join(part if isinstance(part, str) else "*" for part in parts)
    loops = entry.value.entry(FOR_EACH) if isinstance(entry.value, Mapping) else None
    span = entry.key.span if loops is None else loops.key.span
    return LeftOut(section, name, span, FOR_EACH, "")


def _copies(tree: Tree, substitution: Substitution) -> list[tuple[Substitution, Tree]]:
    """Return the copies of an entry; see :func:`_each_copy`."""
    return list(_each_copy(tree, substitution))


def _each_copy(tree: Tree, substitution: Substitution) -> Iterator[tuple[Substitution, Tree]]:
    """Yield a substitution and the tree to apply it to, for each copy of ``tree``."""
    for_each = tree.entry(FOR_EACH) if isinstance(tree, Mapping) else None
    if for_each is None or not isinstance(tree, Mapping):
        yield substitution, tree
        return
    loops = substitution.add(for_each.value, _DEPTH)
    values = _values(loops)
    if values is None:
        # The schema reports the error. The names may have any value.
        names = loops.entries if isinstance(loops, Mapping) else ()
        unknown = {entry.name: Declared(entry.key, None) for entry in names}
        yield substitution.within(substitution.scope.inner(unknown, is_known=False)), tree
        return
    values = [(key, _distinct(choices, substitution.diagnostics)) for key, choices in values]
    if not all(choices for _, choices in values):
        for name in references(tree):
            substitution.scope.use(name)
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
    found = []
    for entry in loops:
        choices = _choices(entry.value)
        if choices is None:
            return None
        found.append((entry.key, choices))
    return found


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


def _choices(tree: Tree) -> tuple[Tree, ...] | None:
    match tree:
        case Sequence(items=items) if all(_is_plain(item) for item in items):
            return items
        case Scalar(value=bool()):
            return None
        case Scalar(value=int() as count) if count >= 0:
            # One more than the maximum is enough to exceed it.
            numbers = range(min(count, MAX_COPIES + 1))
            return tuple(Scalar(number, tree.span, verbatim=False) for number in numbers)
        case _:
            return None


def _is_plain(tree: Tree) -> bool:
    return isinstance(tree, Scalar) and tree.value is not None


def _duplicate_name(noun: str, entry: Entry, earlier: Entry, name: str) -> Diagnostic:
    """Report a name that was made twice, from the same entry or from two."""
    span = entry.key.span
    loops = entry.value.get(FOR_EACH) if isinstance(entry.value, Mapping) else None
    if entry is earlier and isinstance(loops, Mapping):
        used = set(references(entry.key))
        unused = [f"${{{shown(loop.name)}}}" for loop in loops if loop.name not in used]
        hint = _DIFFERENT
        if unused:
            hint = f"make the names unique: '{'_'.join((shown(entry.name), *unused))}'"
        message = f"copies of this {noun} have the same name, '{shown(name)}'"
        return Diagnostic(rules.DUPLICATE_NAME, message, span, hint=hint)
    label = Label(earlier.key.span, "the other one")
    message = f"two {_plural(noun)} are called '{shown(name)}'"
    return Diagnostic(rules.DUPLICATE_NAME, message, span, (label,), "rename one of them")


def _plural(noun: str) -> str:
    return f"{noun}es" if noun.endswith("s") else f"{noun}s"
