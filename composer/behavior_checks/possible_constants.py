"""The constants that an expression may have the value of, through loops and calls."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_checks.parts import possible_values
from composer.behavior_source import Function, helper_named
from composer.behavior_source.flow import returned_values
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.syntax.bindings import Binding, How, is_static, nodes_of
from composer.behavior_types.syntax.names import value_named
from composer.behavior_types.values import ModuleFunction, OwnMethod

#: How many calls the constants of an argument are looked for in.
_MOST = 50


def possible_constants(node: ast.expr, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the constants and other expressions that an expression may have the value of."""
    for item in _written(node, scope):
        yield item
        if isinstance(item, ast.Name):
            for given, outside in passed(item, scope):
                yield from _written(given, outside)
        elif isinstance(item, ast.Call):
            yield from _returned(item, scope)


def _returned(call: ast.Call, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield what a method of the behavior returns that is called."""
    match scope.type_of(call.func):
        case OwnMethod(method=method, home=home) if method.node is not None and method.known:
            inside = scope.owner.scope(method, home)
            if inside is not None and not isinstance(method.node, ast.AsyncFunctionDef):
                for value in returned_values(method.node):
                    yield from possible_values(value, inside)


def _written(node: ast.expr, scope: FunctionTypes) -> Iterator[ast.expr]:
    """Yield the same without calls: for the name of a loop, what it iterates over."""
    for item in possible_values(node, scope):
        binding = only_binding(item, scope)
        is_element = binding is not None and binding.how is How.ELEMENT and not binding.positions
        if is_element and binding is not None and binding.expression is not None:
            yield from _elements(binding.expression, scope) or [item]
        else:
            yield item


def only_binding(node: ast.expr, scope: FunctionTypes) -> Binding | None:
    """Return the binding of a name that has only one, None for others and other expressions."""
    if not isinstance(node, ast.Name):
        return None
    bindings = scope.bindings.of_name(node.id)
    return scope.bindings.uses.get(id(node)) or (bindings[0] if len(bindings) == 1 else None)


def _elements(node: ast.expr, scope: FunctionTypes) -> list[ast.expr]:
    """Return the elements of a tuple or list that is written down, also as a constant."""
    if isinstance(node, ast.Name) and not scope.is_local(node.id):
        found = helper_named(node.id, scope.home)
        if found is None or not found.name:
            return []
        written = value_named(found.name, found.module)
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


def passed(node: ast.Name, scope: FunctionTypes) -> Iterator[tuple[ast.expr, FunctionTypes]]:
    """Yield what calls of a function pass for an argument, each with its scope."""
    binding, function, name = only_binding(node, scope), scope.function, node.id
    if binding is None or binding.how is not How.ANNOTATION:
        return
    if function is None or _compares(function, name):
        return
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
                yield given[name], outside
