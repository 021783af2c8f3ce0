"""From source text to an Expression."""

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
    """Return the compiled expression. Raises ExpressionError when ``source`` is not one.

    Which names are in scope is not judged here: ``Expression.paths`` lists what is used.
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
    # Nothing of this code is the user's: build() made it, out of OPERATIONS and constants.
    compiled: Callable[[Mapping[str, Any]], Any] = eval(  # noqa: S307
        code, {"__builtins__": {}, **OPERATIONS}
    )
    return compiled
