"""Conditions (``if``, ``unless``) of the entries of a system.

    simulator: {if: simulation, type: sensor_simulator}
    driver: {unless: "simulation or lidar == 'none'", type: lidar_driver}

A condition is an expression of the names that ``${...}`` may use. ``${simulation}`` is the same as
``simulation``. An entry whose condition does not hold is left out.
"""

from __future__ import annotations

import re

from composer.base.diagnostics import Diagnostic, shown
from composer.base.source import Span
from composer.language import rules
from composer.language.expand.arguments import as_bool
from composer.language.expand.substitution import Substitution, has_reference, references
from composer.language.expressions import EvaluationError, ExpressionError, compile_expression
from composer.language.tree import Entry, Mapping, Scalar, Tree, describe, plain

CONDITIONS = ("if", "unless")
_WHOLE = re.compile(r"\$\{([^{}]*)\}")


def without_conditions(tree: Tree) -> Tree:
    """Return an entry of a section without its conditions."""
    if not isinstance(tree, Mapping) or not any(entry.name in CONDITIONS for entry in tree):
        return tree
    kept = tuple(entry for entry in tree if entry.name not in CONDITIONS)
    return Mapping(kept, tree.span)


def failed_condition(tree: Tree, substitution: Substitution) -> Entry | None:
    """Return the condition because of which an entry is left out; None if it stays.

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
