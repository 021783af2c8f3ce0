"""Compile expressions: build a syntax tree from safe operations, and refuse anything else."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any, TypeVar

from composer.base.diagnostics import suggestion
from composer.language.expressions.expression import (
    Expression,
    ExpressionError,
    FieldPath,
    Function,
    read_fields,
    read_path,
)
from composer.language.expressions.operations import (
    ARITHMETIC,
    CONSTANTS,
    FUNCTIONS,
    MAXIMUM_INTEGER,
    comparable,
    is_in,
)
from composer.language.expressions.syntax import extent, parse

_MAXIMUM_INDEX = 2**31 - 1
_NOT_IN_LANGUAGE = "this is not part of the expression language"
#: The name of the scope in compiled code.
SCOPE = "scope"
#: The only other names that compiled code can access.
OPERATIONS: Mapping[str, Callable[..., Any]] = {
    **ARITHMETIC,
    **{f"call_{name}": function.call for name, function in FUNCTIONS.items()},
    "comparable": comparable,
    "is_in": is_in,
    "read_fields": read_fields,
    "read_path": read_path,
}
_BINARY: Mapping[type[ast.operator], str] = {
    ast.Add: "add",
    ast.Sub: "subtract",
    ast.Mult: "multiply",
    ast.Div: "divide",
    ast.FloorDiv: "floor_divide",
    ast.Mod: "remainder",
}
_UNARY: Mapping[type[ast.unaryop], str] = {ast.USub: "negative", ast.UAdd: "positive"}
_COMPARISONS = (ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE)
Built = TypeVar("Built", bound=ast.expr)


@lru_cache(maxsize=4096)
def compile_expression(source: str) -> Expression:
    """Return the compiled expression. Raises ExpressionError if ``source`` is invalid.

    Names are not checked here: ``Expression.paths`` lists those in use.
    """
    tree = parse(source)
    body, paths = build(tree)
    return Expression(source, paths, tree, partial(_function, body))


def _function(body: ast.expr) -> Function:
    arguments = ast.arguments(
        posonlyargs=[], args=[ast.arg(SCOPE)], kwonlyargs=[], kw_defaults=[], defaults=[]
    )
    function = ast.copy_location(ast.Lambda(arguments, body), body)
    code = compile(ast.fix_missing_locations(ast.Expression(function)), "<expression>", "eval")
    # Safe: build() made this code from OPERATIONS and constants only.
    compiled: Function = eval(  # noqa: S307
        code, {"__builtins__": {}, **OPERATIONS}
    )
    return compiled


def build(tree: ast.expr) -> tuple[ast.expr, tuple[FieldPath, ...]]:
    """Return a safe tree equivalent to ``tree``, and all field paths in it.

    Raises ExpressionError for anything that is not part of the language.
    """
    paths: list[FieldPath] = []
    return _build(tree, paths), tuple(paths)


def path_of(node: ast.expr) -> FieldPath:
    """Return the field path of a name, attribute or subscript.

    Raises ExpressionError for other nodes.
    """
    offset, length = extent(node)
    parts: list[str | int] = []
    while not isinstance(node, ast.Name):
        match node:
            case ast.Attribute(value=value, attr=name):
                _check_public(node, name)
                parts.append(name)
            case ast.Subscript(value=value, slice=index):
                parts.append(_index(index))
            case _:
                raise _error(node, "only a name has fields and elements")
        node = value
    _check_public(node, node.id)
    if node.id in FUNCTIONS:
        raise _error(node, f"'{node.id}' is a function", f"call it: {node.id}(...)")
    if node.id in CONSTANTS:
        raise _error(node, f"'{node.id}' has no fields and no elements")
    return FieldPath((node.id, *reversed(parts)), offset, length)


def literal(node: ast.expr) -> bool | int | float | str | None:
    """Return the value of a constant with an optional minus; None for other nodes."""
    match node:
        case ast.Constant(value=bool() | int() | float() | str() as value):
            return value
        case ast.Name(id=name) if name in CONSTANTS:
            return CONSTANTS[name]
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as value)):
            return None if isinstance(value, bool) else -value
        case _:
            return None


def _build(node: ast.expr, paths: list[FieldPath]) -> ast.expr:
    builder = _BUILDERS.get(type(node))
    if builder is None:
        raise _error(node, _NOT_IN_LANGUAGE)
    return builder(node, paths)


def _constant(node: ast.Constant, _: list[FieldPath]) -> ast.expr:
    value = literal(node)
    if value is None:
        raise _error(node, _NOT_IN_LANGUAGE)
    _check_size(node, value)
    return _at(node, ast.Constant(value))


def _name(node: ast.Name, paths: list[FieldPath]) -> ast.expr:
    value = CONSTANTS.get(node.id)
    return _path(node, paths) if value is None else _at(node, ast.Constant(value))


def _path(node: ast.expr, paths: list[FieldPath]) -> ast.expr:
    path = path_of(node)
    paths.append(path)
    scope = _at(node, ast.Name(SCOPE, ast.Load()))
    root = _at(node, ast.Subscript(scope, _at(node, ast.Constant(path.root)), ast.Load()))
    match _steps(path.parts[1:]):
        case ():
            return root
        case (tuple() as names,):
            return _call("read_fields", node, root, _at(node, _tuple(names)))
        case steps:
            return _call("read_path", node, root, _at(node, _tuple(steps)))


def _steps(parts: tuple[str | int, ...]) -> tuple[tuple[str, ...] | int, ...]:
    """Return the parts, with consecutive field names in one tuple."""
    steps: list[tuple[str, ...] | int] = []
    names: tuple[str, ...] = ()
    for part in parts:
        if isinstance(part, str):
            names += (part,)
            continue
        steps += [names, part] if names else [part]
        names = ()
    return (*steps, names) if names else tuple(steps)


def _arithmetic(node: ast.BinOp, paths: list[FieldPath]) -> ast.expr:
    operation = _BINARY.get(type(node.op))
    if operation is None:
        raise _error(node, _NOT_IN_LANGUAGE)
    return _call(operation, node, _build(node.left, paths), _build(node.right, paths))


def _unary(node: ast.UnaryOp, paths: list[FieldPath]) -> ast.expr:
    operand = _build(node.operand, paths)
    if isinstance(node.op, ast.Not):
        return _at(node, ast.UnaryOp(ast.Not(), operand))
    operation = _UNARY.get(type(node.op))
    if operation is None:
        raise _error(node, _NOT_IN_LANGUAGE)
    return _call(operation, node, operand)


def _boolean(node: ast.BoolOp, paths: list[FieldPath]) -> ast.expr:
    return _at(node, ast.BoolOp(node.op, [_build(value, paths) for value in node.values]))


def _choice(node: ast.IfExp, paths: list[FieldPath]) -> ast.expr:
    body, test, orelse = (_build(part, paths) for part in (node.body, node.test, node.orelse))
    return _at(node, ast.IfExp(test, body, orelse))


def _comparison(node: ast.Compare, paths: list[FieldPath]) -> ast.expr:
    if len(node.ops) == 1 and isinstance(node.ops[0], ast.In | ast.NotIn):
        return _membership(node, paths)
    if not all(isinstance(operator, _COMPARISONS) for operator in node.ops):
        hint = "compare with ==, !=, <, <=, > or >=; 'in' stands alone"
        raise _error(node, "this comparison is not part of the expression language", hint)
    sides = [
        _call("comparable", side, _build(side, paths)) for side in (node.left, *node.comparators)
    ]
    return _at(node, ast.Compare(sides[0], node.ops, sides[1:]))


def _membership(node: ast.Compare, paths: list[FieldPath]) -> ast.expr:
    item = _build(node.left, paths)
    container = node.comparators[0]
    if isinstance(container, ast.Tuple | ast.List):
        values = tuple(_list_item(element) for element in container.elts)
        built: ast.expr = _at(container, _tuple(values))
    else:
        built = _build(container, paths)
    test = _call("is_in", node, item, built)
    return _at(node, ast.UnaryOp(ast.Not(), test)) if isinstance(node.ops[0], ast.NotIn) else test


def _list_item(node: ast.expr) -> bool | int | float | str:
    value = literal(node)
    if value is None:
        raise _error(node, "a list after 'in' may contain only numbers, strings, true and false")
    _check_size(node, value)
    return value


def _function_call(node: ast.Call, paths: list[FieldPath]) -> ast.expr:
    if not isinstance(node.func, ast.Name):
        raise _error(node.func, "only the functions of the language can be called")
    name = node.func.id
    function = FUNCTIONS.get(name)
    if function is None:
        raise _error(node.func, f"unknown function '{name}'", suggestion(name, FUNCTIONS))
    if node.keywords:
        raise _error(node.keywords[0].value, "functions take no named arguments")
    if not function.takes(len(node.args)):
        raise _error(node, f"'{name}' takes {function.arguments}, not {len(node.args)}")
    return _call(f"call_{name}", node, *(_build(argument, paths) for argument in node.args))


_BUILDERS: Mapping[type[ast.expr], Callable[[Any, list[FieldPath]], ast.expr]] = {
    ast.Attribute: _path,
    ast.BinOp: _arithmetic,
    ast.BoolOp: _boolean,
    ast.Call: _function_call,
    ast.Compare: _comparison,
    ast.Constant: _constant,
    ast.IfExp: _choice,
    ast.Name: _name,
    ast.Subscript: _path,
    ast.UnaryOp: _unary,
}


def _check_public(node: ast.expr, name: str) -> None:
    if name.startswith("_"):
        raise _error(node, f"'{name}' begins with an underscore, as no field does")


def _check_size(node: ast.expr, value: bool | int | float | str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise _error(node, "the number is too large")
    if isinstance(value, int) and abs(value) > MAXIMUM_INTEGER:
        raise _error(node, "the number is too large")


def _index(node: ast.expr) -> int:
    value = literal(node)
    if type(value) is not int or abs(value) > _MAXIMUM_INDEX:
        raise _error(node, "an index is an integer, as in poses[0] or poses[-1]")
    return value


def _error(node: ast.expr, message: str, hint: str | None = None) -> ExpressionError:
    return ExpressionError(message, *extent(node), hint)


def _at(origin: ast.expr, node: Built) -> Built:
    """Return ``node`` with the location of ``origin``, for error messages."""
    return ast.copy_location(node, origin)


def _tuple(values: tuple[bool | int | float | str | tuple[str, ...], ...]) -> ast.Constant:
    return ast.Constant(values)  # type: ignore[arg-type]  # compile() takes tuples of constants


def _call(operation: str, node: ast.expr, *arguments: ast.expr) -> ast.expr:
    function = _at(node, ast.Name(operation, ast.Load()))
    return _at(node, ast.Call(function, list(arguments), []))
