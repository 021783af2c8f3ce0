"""Lambdas that a function calls with the elements of its other argument."""

from __future__ import annotations

import ast
from collections.abc import Iterator


def lambdas_over(call: ast.Call) -> Iterator[tuple[ast.arg, ast.expr]]:
    """Yield the argument of such a lambda, with what its elements are of.

    As in ``sorted(items, key=lambda item: ...)`` or ``filter(lambda item: ..., items)``.
    """
    match call:
        case ast.Call(
            func=ast.Name(id="filter" | "map" | "takewhile" | "dropwhile")
            | ast.Attribute(value=ast.Name(id="itertools"), attr="takewhile" | "dropwhile"),
            args=[function, items],
        ):
            functions = [function]
        case (
            ast.Call(
                func=ast.Name(id="max" | "min" | "sorted" | "groupby")
                | ast.Attribute(value=ast.Name(id="itertools"), attr="groupby"),
                args=[items],
                keywords=keywords,
            )
            | ast.Call(func=ast.Attribute(value=items, attr="sort"), args=[], keywords=keywords)
        ):
            functions = [item.value for item in keywords if item.arg == "key"]
        case _:
            return
    for function in functions:
        match function:
            case ast.Lambda(args=ast.arguments(args=[argument], posonlyargs=[])):
                yield argument, items
