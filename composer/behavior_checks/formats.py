"""Checks how values are formatted, and what is raised."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions import FunctionTypes
from composer.behavior_types.operators import is_text
from composer.behavior_types.own_classes import known_attributes
from composer.behavior_types.values import NONE, Collection, OwnObject, Value
from composer.interfaces import Message

_CONVERSION = re.compile(
    r"%(?P<key>\([^)]*\))?[-#0 +]*(?P<star>\*|\d+)?(?:\.(?:\*|\d+))?[hlL]?(?P<type>.)"
)


def text_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why a value cannot be formatted, or raised."""
    match node:
        case ast.FormattedValue(value=value, conversion=-1, format_spec=ast.JoinedStr() as written):
            problem = _format_problem(scope.type_of(value), written)
        case ast.Raise(exc=ast.expr() as value):
            problem = _raise_problem(scope.type_of(value))
        case _:
            return
    if problem is not None:
        yield CodeProblem(Kind.VALUE, problem, span_of(value, scope.home.source))


def _format_problem(value: Value, written: ast.JoinedStr) -> str | None:
    """Return why ``{value:format}`` fails, None if it may be right."""
    spec = "".join(
        str(part.value) if isinstance(part, ast.Constant) else "?" for part in written.values
    )
    if not spec or "?" in spec:
        return None
    is_plain = isinstance(value, OwnObject) and _has_no_format(value)
    is_collection = isinstance(value, Collection) and value.python in (list, dict, tuple, set)
    if isinstance(value, Message) or is_plain or is_collection or value is NONE:
        what = "None" if value is NONE else shown(value)
        return f"{what} cannot be formatted with ':{spec}'"
    if is_text(value) and spec[-1] in "bcdeEfFgGnoxX%":
        return f"a string cannot be formatted with ':{spec}'"
    return None


def _has_no_format(value: OwnObject) -> bool:
    own = {method.name for method in value.of.definition.methods}
    return (
        known_attributes(value.of) is not None
        and "__format__" not in own
        and not (value.of.definition.bases)
    )


def percent_problem(
    left: ast.expr, operator: ast.operator, right: ast.expr, value: Value
) -> str | None:
    """Return why ``"..." % (...)`` has too few or too many values, None if it may be right."""
    is_one = kind_of(value) in {"number", "text"} or isinstance(value, Message)
    if not isinstance(operator, ast.Mod) or not (isinstance(right, ast.Tuple) or is_one):
        return None
    if not isinstance(left, ast.Constant) or not isinstance(left.value, str):
        return None
    items = right.elts if isinstance(right, ast.Tuple) else [right]
    if any(isinstance(item, ast.Starred) for item in items):
        return None
    found = [item for item in _CONVERSION.finditer(left.value) if item["type"] != "%"]
    if any(item["key"] or "*" in item[0] for item in found):
        return None
    if len(found) == len(items):
        return None
    return f"{len(items)} values for {len(found)} placeholders"


def _raise_problem(value: Value) -> str | None:
    """Return why a value cannot be raised, None if it may be an exception."""
    if kind_of(value) in (None, "function") or isinstance(value, OwnObject):
        return None
    return f"{shown(value)} is raised, which is not an exception"
