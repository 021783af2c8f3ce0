"""The values that a parameter may have where it is a key or the value of a member."""

from __future__ import annotations

import ast
from functools import lru_cache

from composer.behavior_checks.guards import OF_CHOICES, handles
from composer.behavior_checks.messages.elements import parameter_read
from composer.behavior_source import Module
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes


def parameter_values(node: ast.expr, scope: FunctionTypes) -> list[str | int]:
    """Return the value and the choices of the parameter that an expression reads, or changes.

    There are none if the files may do otherwise with some of them.
    """
    match node:
        case ast.Call(
            func=ast.Attribute(value=owner, attr="lower" | "strip" | "title" | "upper" as changed),
            args=[],
            keywords=[],
        ):
            before = parameter_values(owner, scope)
            return [getattr(item, changed)() for item in before if isinstance(item, str)]
    parameter = parameter_read(node, scope)
    if parameter is None or (scope.function is not None and handles(scope.function, OF_CHOICES)):
        return []
    name = parameter.name.value
    if any(name in _compared(module) for module in scope.owner.source.own_modules):
        return []
    values = [] if parameter.value is None else [parameter.value.value]
    values += parameter.choices.value if parameter.choices is not None else ()
    return [item for item in values if isinstance(item, str | int) and not isinstance(item, bool)]


@lru_cache(maxsize=128)
def _compared(module: Module) -> frozenset[str]:
    """Return the parameters that a file compares, tests, or gives another name."""
    found: set[str] = set()
    for node in walk(module.tree.body):
        match node:
            case ast.Compare(left=left, comparators=others):
                tested = [left, *others]
            case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
                tested = [test]
            case ast.Match(subject=test) | ast.Assign(value=ast.Attribute() as test):
                tested = [test]
            case ast.AnnAssign(value=ast.Attribute() as test) | ast.NamedExpr(value=test):
                tested = [test]
            case _:
                continue
        found.update(
            item.attr
            for item in walk(tested)
            if isinstance(item, ast.Attribute) and getattr(item.value, "id", "") != "self"
        )
    return frozenset(found)
