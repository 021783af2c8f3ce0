"""Compile source text to an Expression."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from composer.expressions.builder import OPERATIONS, SCOPE, build
from composer.expressions.expression import Expression
from composer.expressions.syntax import parse


@lru_cache(maxsize=4096)
def compile_expression(source: str) -> Expression:
    """Return the compiled expression. Raises ExpressionError if ``source`` is invalid.

    Names are not checked here: ``Expression.paths`` lists those in use.
    """
    tree = parse(source)
    body, paths = build(tree)
    return Expression(source, paths, tree, _function(body))


def _function(body: ast.expr) -> Callable[[Mapping[str, Any]], Any]:
    arguments = ast.arguments(
        posonlyargs=[], args=[ast.arg(SCOPE)], kwonlyargs=[], kw_defaults=[], defaults=[]
    )
    function = ast.copy_location(ast.Lambda(arguments, body), body)
    code = compile(ast.fix_missing_locations(ast.Expression(function)), "<expression>", "eval")
    # Safe: build() made this code from OPERATIONS and constants only.
    compiled: Callable[[Mapping[str, Any]], Any] = eval(  # noqa: S307
        code, {"__builtins__": {}, **OPERATIONS}
    )
    return compiled
