"""Checks the groups that are read from a match against its pattern."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.syntax.names import constant_named

_MATCHING = frozenset({"fullmatch", "match", "search"})
_WITH_GROUPS = frozenset({"end", "group", "span", "start"})
#: Longer patterns are not compiled.
_LONGEST = 500


def group_problems(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield a group that the pattern of a match does not have."""
    if name not in _WITH_GROUPS or not isinstance(call.func, ast.Attribute):
        return
    pattern = pattern_of(call.func.value, scope)
    for argument in call.args if pattern is not None else ():
        group = argument.value if isinstance(argument, ast.Constant) else integer_constant(argument)
        if pattern is None or not isinstance(group, int | str) or isinstance(group, bool):
            continue
        is_known = group in pattern.groupindex if isinstance(group, str) else None
        if is_known or (isinstance(group, int) and 0 <= group <= pattern.groups):
            continue
        count = f"{pattern.groups} group" + ("" if pattern.groups == 1 else "s")
        message = f"the pattern has no group {group!r}: it has {count}"
        yield CodeProblem(Kind.VALUE, message, span_of(argument, scope.home.source))
        return


def pattern_of(node: ast.expr, scope: FunctionTypes) -> re.Pattern[str] | None:
    """Return the pattern of a match that a name, or a call itself, is; None if not known."""
    value = scope.bindings.value_of(node.id) if isinstance(node, ast.Name) else node
    match value:
        case ast.Call(func=ast.Attribute(value=owner, attr=name) as function, args=[first, *_]):
            if name not in _MATCHING:
                return None
            if scope.called_name(function) == f"re.{name}":
                return _compiled(first)
            constant = None
            if isinstance(owner, ast.Name) and not scope.is_local(owner.id):
                constant = constant_named(owner.id, scope.home)
            match constant:
                case ast.Call(func=made, args=[text, *_]) if (
                    scope.owner.at_module(scope.home).called_name(made) == "re.compile"
                ):
                    return _compiled(text)
    return None


def _compiled(node: ast.expr) -> re.Pattern[str] | None:
    text = node.value if isinstance(node, ast.Constant) else None
    if not isinstance(text, str) or len(text) > _LONGEST:
        return None
    try:
        return re.compile(text)
    except (re.error, RecursionError, OverflowError):
        return None
