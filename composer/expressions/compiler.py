"""From source text to an Expression: parse, rebuild from safe operations only, compile."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from composer.diagnostics import suggestion
from composer.expressions.errors import ExpressionError
from composer.expressions.expression import Expression, FieldPath, Result
from composer.expressions.operations import (
    ARITHMETIC,
    CONSTANTS,
    FUNCTIONS,
    MAXIMUM_INTEGER,
    comparable,
    is_in,
    read_fields,
    read_path,
)
from composer.expressions.tokens import check_tokens

MAXIMUM_LENGTH = 500
MAXIMUM_NODES = 64
_MAXIMUM_INDEX = 2**31 - 1

#: All that compiled code can reach: nothing is looked up anywhere else.
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
_ORDERING = (ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_RESULTS: Mapping[str, Result] = {
    "bool": Result.BOOL,
    "ceil": Result.INTEGER,
    "floor": Result.INTEGER,
    "int": Result.INTEGER,
    "len": Result.INTEGER,
    "str": Result.TEXT,
}


@lru_cache(maxsize=4096)
def compile_expression(source: str) -> Expression:
    """Return the compiled expression. Raises ExpressionError when ``source`` is not one.

    Which names are in scope is not judged here: ``Expression.paths`` lists what is used.
    """
    _check_length(source)
    check_tokens(source)
    tree = _parse(source)
    nodes = sum(isinstance(node, ast.expr) for node in ast.walk(tree))
    if nodes > MAXIMUM_NODES:
        message = f"the expression has {nodes} parts, more than {MAXIMUM_NODES}"
        raise ExpressionError(message, 0, len(source))
    builder = _Builder(source)
    body = builder.build(tree)
    return Expression(source, tuple(builder.paths), _result_of(tree), _function(body))


def _check_length(source: str) -> None:
    if not source.strip():
        raise ExpressionError("the expression is empty", 0, len(source))
    if len(source) > MAXIMUM_LENGTH:
        message = f"the expression has {len(source)} characters, more than {MAXIMUM_LENGTH}"
        raise ExpressionError(message, 0, MAXIMUM_LENGTH)


def _parse(source: str) -> ast.expr:
    flat = "".join(" " if character in "\t\r\n" else character for character in source)
    text = flat.lstrip(" ")
    skipped = len(flat) - len(text)
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise _syntax_error(source, error, skipped) from None
    except (ValueError, RecursionError, MemoryError):  # lone surrogates; a caller's deep stack
        raise ExpressionError("the expression cannot be read", 0, len(source)) from None
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            node.col_offset += skipped
            node.end_col_offset = (node.end_col_offset or 0) + skipped
    return tree


def _syntax_error(source: str, error: SyntaxError, skipped: int) -> ExpressionError:
    offset = skipped + (error.offset or 1) - 1
    if offset >= len(source.rstrip()):
        return ExpressionError("the expression ends too early", max(len(source.rstrip()) - 1, 0))
    end = skipped + error.end_offset - 1 if error.end_offset else offset + 1
    message = error.msg.split(". ")[0]  # what follows speaks of Python, not of this language
    return ExpressionError(message, offset, max(end - offset, 1))


def _function(body: ast.expr) -> Callable[[Mapping[str, Any]], Any]:
    arguments = ast.arguments(
        posonlyargs=[], args=[ast.arg("scope")], kwonlyargs=[], kw_defaults=[], defaults=[]
    )
    tree = ast.Expression(ast.Lambda(arguments, body))
    ast.fix_missing_locations(ast.copy_location(tree.body, body))
    code = compile(tree, "<expression>", "eval")
    # The code is not the user's: _Builder made it, out of OPERATIONS and constants.
    return eval(code, {"__builtins__": {}, **OPERATIONS})  # type: ignore[no-any-return]  # noqa: S307


def _result_of(node: ast.expr) -> Result:
    match node:
        case ast.Name(id=name) if name in CONSTANTS:
            return Result.NUMBER if name == "pi" else Result.BOOL
        case ast.Name() | ast.Attribute() | ast.Subscript():
            return Result.PATH
        case ast.Constant(value=value):
            return _result_of_constant(value)
        case ast.Compare() | ast.UnaryOp(op=ast.Not()):
            return Result.BOOL
        case ast.UnaryOp(operand=operand):
            return Result.INTEGER if _result_of(operand) is Result.INTEGER else Result.NUMBER
        case ast.BinOp():
            return _result_of_arithmetic(node)
        case ast.Call(func=ast.Name(id=name)):
            return _RESULTS.get(name, Result.NUMBER)
        case ast.IfExp(body=body, orelse=orelse):
            return _common((body, orelse))
        case ast.BoolOp(values=values):
            return _common(tuple(values))
        case _:
            return Result.UNKNOWN


def _result_of_constant(value: object) -> Result:
    if isinstance(value, bool):
        return Result.BOOL
    if isinstance(value, str):
        return Result.TEXT
    return Result.INTEGER if isinstance(value, int) else Result.NUMBER


def _result_of_arithmetic(node: ast.BinOp) -> Result:
    if isinstance(node.op, ast.Div):
        return Result.NUMBER
    sides = (_result_of(node.left), _result_of(node.right))
    return Result.INTEGER if sides == (Result.INTEGER, Result.INTEGER) else Result.NUMBER


def _common(nodes: tuple[ast.expr, ...]) -> Result:
    results = {_result_of(node) for node in nodes}
    only = results.pop()
    return Result.UNKNOWN if results or only is Result.PATH else only


class _Builder:
    """Builds the tree that is compiled. What it does not know, it refuses."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.paths: list[FieldPath] = []

    def build(self, node: ast.expr) -> ast.expr:
        match node:
            case ast.Constant():
                return self._constant(node)
            case ast.Name(id=name) if name in CONSTANTS:
                return _at(node, ast.Constant(CONSTANTS[name]))
            case ast.Name() | ast.Attribute() | ast.Subscript():
                return self._path(node)
            case ast.BinOp(op=op, left=left, right=right) if type(op) in _BINARY:
                return self._call(_BINARY[type(op)], node, left, right)
            case ast.UnaryOp():
                return self._unary(node)
            case ast.BoolOp(op=op, values=values):
                return _at(node, ast.BoolOp(op, [self.build(value) for value in values]))
            case ast.Compare():
                return self._compare(node)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                parts = (self.build(test), self.build(body), self.build(orelse))
                return _at(node, ast.IfExp(*parts))
            case ast.Call():
                return self._function_call(node)
            case _:
                raise self._error(node, "this is not part of the expression language")

    def _error(self, node: ast.expr, message: str, hint: str | None = None) -> ExpressionError:
        start, end = self._extent(node)
        return ExpressionError(message, start, end - start, hint)

    def _extent(self, node: ast.expr) -> tuple[int, int]:
        """Return start and end in characters; Python counts in UTF-8 bytes."""
        data = self.source.encode()
        start, end = node.col_offset, node.end_col_offset or node.col_offset + 1
        return len(data[:start].decode(errors="replace")), len(data[:end].decode(errors="replace"))

    def _call(self, operation: str, node: ast.expr, *arguments: ast.expr) -> ast.expr:
        return _call(operation, node, *(self.build(argument) for argument in arguments))

    def _constant(self, node: ast.Constant) -> ast.Constant:
        value = node.value
        if not isinstance(value, bool | int | float | str):
            raise self._error(node, f"'{value}' is not a value of the expression language")
        if isinstance(value, int) and value > MAXIMUM_INTEGER:
            raise self._error(node, "the number is too large")
        if isinstance(value, float) and not math.isfinite(value):
            raise self._error(node, "the number is too large")
        return _at(node, ast.Constant(value))

    def _unary(self, node: ast.UnaryOp) -> ast.expr:
        match node.op:
            case ast.Not():
                return _at(node, ast.UnaryOp(ast.Not(), self.build(node.operand)))
            case ast.USub():
                return self._call("negative", node, node.operand)
            case ast.UAdd():
                return self._call("positive", node, node.operand)
            case _:
                raise self._error(node, "this is not part of the expression language")

    def _path(self, node: ast.expr) -> ast.expr:
        root, parts = self._parts(node)
        if root.id in FUNCTIONS:
            raise self._error(root, f"'{root.id}' is a function", f"call it: {root.id}(...)")
        start, end = self._extent(node)
        self.paths.append(FieldPath((root.id, *parts), start, end - start))
        scope = _at(root, ast.Name("scope", ast.Load()))
        value = _at(root, ast.Subscript(scope, _at(root, ast.Constant(root.id)), ast.Load()))
        if not parts:
            return value
        operation = "read_fields" if all(isinstance(part, str) for part in parts) else "read_path"
        return _call(operation, node, value, _at(node, ast.Constant(parts)))

    def _parts(self, node: ast.expr) -> tuple[ast.Name, tuple[str | int, ...]]:
        parts: list[str | int] = []
        while not isinstance(node, ast.Name):
            match node:
                case ast.Attribute(value=value, attr=name):
                    self._check_public(node, name)
                    parts.append(name)
                case ast.Subscript(value=value, slice=index):
                    parts.append(self._index(index))
                case _:
                    raise self._error(node, "only a name has fields and elements")
            node = value
        self._check_public(node, node.id)
        return node, tuple(reversed(parts))

    def _check_public(self, node: ast.expr, name: str) -> None:
        if name.startswith("_"):
            raise self._error(node, f"'{name}' begins with an underscore, as no field does")

    def _index(self, node: ast.expr) -> int:
        value = _number(node)
        if type(value) is not int or abs(value) > _MAXIMUM_INDEX:
            raise self._error(node, "an index is an integer, as in poses[0] or poses[-1]")
        return value

    def _compare(self, node: ast.Compare) -> ast.expr:
        if len(node.ops) == 1 and isinstance(node.ops[0], ast.In | ast.NotIn):
            return self._membership(node)
        if not all(isinstance(op, _ORDERING) for op in node.ops):
            hint = "compare with == or !=; 'in' stands alone"
            raise self._error(node, "this comparison is not part of the language", hint)
        operands = [self._call("comparable", side, side) for side in (node.left, *node.comparators)]
        return _at(node, ast.Compare(operands[0], node.ops, operands[1:]))

    def _membership(self, node: ast.Compare) -> ast.expr:
        container = node.comparators[0]
        built = (
            _at(container, ast.Constant(tuple(self._literal(item) for item in container.elts)))
            if isinstance(container, ast.Tuple | ast.List)
            else self.build(container)
        )
        test = _call("is_in", node, self.build(node.left), built)
        return _at(node, ast.UnaryOp(ast.Not(), test)) if _is_negated(node) else test

    def _literal(self, node: ast.expr) -> object:
        number = _number(node)
        if number is not None:
            return number
        match self.build(node):
            case ast.Constant(value=value):
                return value
            case _:
                raise self._error(node, "a list after 'in' holds numbers, texts, true and false")

    def _function_call(self, node: ast.Call) -> ast.expr:
        if not isinstance(node.func, ast.Name):
            raise self._error(node.func, "only the functions of the language can be called")
        name = node.func.id
        function = FUNCTIONS.get(name)
        if function is None:
            raise self._error(node.func, f"unknown function '{name}'", suggestion(name, FUNCTIONS))
        if node.keywords:
            raise self._error(node.keywords[0].value, "functions take no named arguments")
        count = len(node.args)
        if count < function.least or (function.most is not None and count > function.most):
            wanted = _wanted(function.least, function.most)
            raise self._error(node, f"'{name}' takes {wanted}, not {count}")
        return self._call(f"call_{name}", node, *node.args)


def _wanted(least: int, most: int | None) -> str:
    if least == most:
        return f"{least} argument" + ("s" if least > 1 else "")
    return f"at least {least} argument" if most is None else f"{least} or {most} arguments"


def _is_negated(node: ast.Compare) -> bool:
    return isinstance(node.ops[0], ast.NotIn)


def _number(node: ast.expr) -> object:
    """Return a number with an optional minus, bounded; None for anything else."""
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as value)):
            number: int | float = -value
        case ast.Constant(value=int() | float() as value):
            number = value
        case _:
            return None
    return number if abs(number) <= MAXIMUM_INTEGER and not isinstance(value, bool) else None


def _at(origin: ast.expr, node: Any) -> Any:
    """Return ``node`` with the place of ``origin``, so that a failure names its part."""
    return ast.copy_location(node, origin)


def _call(operation: str, node: ast.expr, *arguments: ast.expr) -> ast.expr:
    function = _at(node, ast.Name(operation, ast.Load()))
    call: ast.expr = _at(node, ast.Call(function, list(arguments), []))
    return call
