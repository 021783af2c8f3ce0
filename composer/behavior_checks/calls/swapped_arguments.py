"""Finds arguments that have each the name of the other one's parameter."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import combinations

from composer.behavior_checks.calls.arguments import Signature
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import nodes_of
from composer.behavior_types.values import Parameters
from composer.interfaces import Message

#: Shorter names, such as x and y, often take turns.
_SHORTEST = 3


def swapped_arguments(
    call: ast.Call, signature: Signature, called: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield two arguments that are swapped, one of which is a field or a parameter of the node.

    Code that turns something around names it alike, as in ``from_frame``, calls the function in the
    other order as well, or is the function itself.
    """
    if scope.function is None or scope.function is called:
        return
    given = dict(signature.bound(call))
    names = {name: _last(node) for name, node in given.items()}
    for first, second in combinations(names, 2):
        if (names[first], names[second]) != (second, first) or len(first) < _SHORTEST > len(second):
            continue
        parts = set(first.split("_")) & set(second.split("_"))
        is_of_message = any(_is_field(given[name], scope) for name in (first, second))
        if parts or not is_of_message or _turns(call, first, second, signature, scope.function):
            continue
        message = f"'{second}' is passed as '{first}', and '{first}' as '{second}'"
        span = span_of(given[first], scope.home.source)
        yield CodeProblem(Kind.CALL, message, span, "swap them")
        return


def _is_field(node: ast.expr, scope: FunctionTypes) -> bool:
    if not isinstance(node, ast.Attribute):
        return False
    return isinstance(scope.type_of(node.value), Message | Parameters)


def _turns(
    call: ast.Call, first: str, second: str, signature: Signature, function: Function
) -> bool:
    """Return whether a function calls another one in the right order as well."""
    written = dotted(call.func)
    for node in nodes_of(function):
        if isinstance(node, ast.Call) and node is not call and dotted(node.func) == written:
            names = {name: _last(item) for name, item in signature.bound(node)}
            if (names.get(first), names.get(second)) == (first, second):
                return True
    return False


def _last(node: ast.expr) -> str:
    return dotted(node).rpartition(".")[2]
