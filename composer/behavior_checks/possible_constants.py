"""The constants that an expression may have the value of, through loops and calls."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.parts import possible_values
from composer.behavior_source import Function, helper_named
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import How, is_static, nodes_of
from composer.behavior_types.syntax.names import constant_named
from composer.behavior_types.values import ModuleFunction, OwnMethod

#: How many calls the constants of an argument are looked for in.
_MOST = 50


def possible_constants(node: ast.expr, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the constants and other expressions that an expression may have the value of."""
    for item in possible_values(node, scope):
        if not isinstance(item, ast.Name):
            yield item
            continue
        bindings = scope.bindings.of_name(item.id)
        only = scope.bindings.uses.get(id(item)) or (bindings[0] if len(bindings) == 1 else None)
        is_plain = only is not None and not only.positions
        if only is not None and is_plain and only.how is How.ELEMENT and only.expression:
            yield from _elements(only.expression, scope) or [item]
            continue
        yield item
        is_argument = only is not None and only.how is How.ANNOTATION
        function = scope.function if is_argument else None
        if function is not None and not _compares(function, item.id):
            yield from _passed(function, item.id, scope)


def _elements(node: ast.expr, scope: FunctionTypes) -> list[ast.expr]:
    """Return the elements of a tuple or list that is written down, also as a constant."""
    if isinstance(node, ast.Name) and not scope.is_local(node.id):
        found = helper_named(node.id, scope.home)
        if found is None or not found.name:
            return []
        constant = constant_named(found.name, found.module)
        written = constant.value if isinstance(constant, ast.AnnAssign) else constant
        return written.elts if isinstance(written, ast.Tuple) else []
    return node.elts if isinstance(node, ast.List | ast.Tuple) else []


def _compares(function: Function, name: str) -> bool:
    """Return whether a function compares an argument, and may do otherwise with some values."""
    return any(
        isinstance(part, ast.Name) and part.id == name
        for node in nodes_of(function)
        if isinstance(node, ast.Compare | ast.Match)
        for part in ast.walk(node.subject if isinstance(node, ast.Match) else node)
    )


def _passed(function: Function, name: str, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the constants that calls of a function pass as an argument."""
    from composer.behavior_types.call_sites import (  # noqa: PLC0415 (start-up time)
        references_in,
        scope_of,
    )

    types = scope.owner
    names = [item.arg for item in (*function.args.posonlyargs, *function.args.args)]
    count = 0
    for module in types.source.own_modules:
        for reference in references_in(module).get(function.name, ()):
            call, count = reference.call, count + 1
            if call is None or count > _MOST:
                continue
            outside = scope_of(types, reference)
            match outside.type_of(call.func):
                case OwnMethod(method=method) if method.node is function:
                    is_bound = not is_static(function)
                case ModuleFunction(node=definition, is_bound=is_bound) if definition is function:
                    pass
                case _:
                    continue
            given = dict(zip(names[1 if is_bound else 0 :], call.args, strict=False))
            given.update({item.arg: item.value for item in call.keywords if item.arg})
            if name in given and not any(isinstance(item, ast.Starred) for item in call.args):
                yield from _written(given[name], outside)


def _written(node: ast.expr, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the constants that an argument may be, not those of further calls."""
    for item in possible_values(node, scope):
        if not isinstance(item, ast.Name):
            yield item
            continue
        bindings = scope.bindings.of_name(item.id)
        only = scope.bindings.uses.get(id(item)) or (bindings[0] if len(bindings) == 1 else None)
        is_element = only is not None and only.how is How.ELEMENT and not only.positions
        if only is not None and only.expression is not None and is_element:
            yield from _elements(only.expression, scope)
