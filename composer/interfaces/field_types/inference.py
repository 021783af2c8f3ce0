"""Type inference for expressions, from their syntax and the types of the names in scope."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import field
from itertools import pairwise
from typing import Any

from composer.base.diagnostics import Diagnostic, suggestion
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import FieldType, Interfaces
from composer.interfaces.field_types.types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STRING,
    PathProblem,
    Scope,
    ValueType,
    Word,
    described,
    is_array,
    is_bool,
    is_integer,
    is_number,
    is_string,
    problem_at,
    resolve_path,
)
from composer.language.expressions import CONSTANTS, Expression, FieldPath, path_of

_CONVERSIONS: Mapping[str, ValueType] = {
    "bool": BOOL,
    "float": NUMBER,
    "int": INTEGER,
    "str": STRING,
}


@dataclass(slots=True)
class Inference:
    """The state of the inference for one expression at ``span``.

    Parts of an expression have spans of their own only if the file contains it literally.
    """

    interfaces: Interfaces
    scope: Scope
    span: Span
    is_literal: bool
    problems: list[Diagnostic] = field(default_factory=list)
    offsets: list[int] = field(default_factory=list)  # of the problems, in characters

    def report(
        self, offset: int, length: int, message: str, hint: str | None, *, missing: bool = False
    ) -> ValueType:
        """Add a problem with a part of the expression, whose type is unknown then."""
        span = self.span.part(offset, length) if self.is_literal else self.span
        self.problems.append(problem_at(span, message, hint, missing=missing))
        self.offsets.append(offset)
        return ANYTHING


def infer(
    expression: Expression, span: Span, scope: Scope, interfaces: Interfaces
) -> tuple[ValueType, list[Diagnostic]]:
    """Return the type of the value of an expression at ``span``, and the problems in it."""
    inference = Inference(interfaces, scope, span, span.length == len(expression.source))
    return _infer(expression.tree, inference), inference.problems


def literal_integer(expression: Expression) -> int | None:
    """Return the integer that an expression consists of, possibly with a sign; None for others."""
    node, sign = expression.tree, 1
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node, sign = node.operand, -1
    value = node.value if isinstance(node, ast.Constant) else None
    return sign * value if isinstance(value, int) and not isinstance(value, bool) else None


def _infer(node: ast.expr, inference: Inference) -> ValueType:
    return _RULES[type(node)](node, inference)


def _constant(node: ast.Constant, _: Inference) -> ValueType:
    match node.value:
        case bool():
            return BOOL
        case int():
            return INTEGER
        case float():
            return NUMBER
        case _:
            return STRING


def _name(node: ast.Name, inference: Inference) -> ValueType:
    if node.id in CONSTANTS:
        return BOOL if isinstance(CONSTANTS[node.id], bool) else NUMBER
    return _path(node, inference)


def _path(node: ast.expr, inference: Inference) -> ValueType:
    path = path_of(node)
    if path.root not in inference.scope:
        hint = suggestion(path.root, inference.scope)
        message = f"name '{path.root}' is not available here"
        return inference.report(path.offset, len(path.root), message, hint, missing=True)
    found = resolve_path(inference.scope[path.root], path.parts[1:], inference.interfaces)
    if isinstance(found, PathProblem):
        part = _part(path, found.index + 1)
        return inference.report(*part, found.message, found.hint, missing=True)
    return found


def _part(path: FieldPath, index: int) -> tuple[int, int]:
    """Return offset and length of one part of a path; of the whole path if it contains spaces."""
    if len(str(path)) != path.length:
        return path.offset, path.length
    before = len(str(FieldPath(path.parts[:index], 0, 0)))
    upto = len(str(FieldPath(path.parts[: index + 1], 0, 0)))
    dot = 1 if isinstance(path.parts[index], str) else 0
    return path.offset + before + dot, upto - before - dot


def _arithmetic(node: ast.BinOp, inference: Inference) -> ValueType:
    sides = [_number(side, inference) for side in (node.left, node.right)]
    if isinstance(node.op, ast.Div):
        return NUMBER
    return _common_number(sides)


def _unary(node: ast.UnaryOp, inference: Inference) -> ValueType:
    if isinstance(node.op, ast.Not):
        _infer(node.operand, inference)
        return BOOL
    return _common_number([_number(node.operand, inference)])


def _number(node: ast.expr, inference: Inference) -> ValueType:
    """Return the type of an operand, and report it unless it is a number."""
    found = _infer(node, inference)
    if found is ANYTHING or is_number(found):
        return found
    hint = None
    if is_string(found):
        hint = "use float(...); to join strings, write several {...} in one string"
    elif is_bool(found):
        hint = "use int(...)"
    return _report(node, inference, f"{described(found)} where a number is expected", hint)


def _common_number(types: list[ValueType]) -> ValueType:
    if all(map(is_integer, types)):
        return INTEGER
    is_known_float = any(not is_integer(found) and is_number(found) for found in types)
    return NUMBER if is_known_float else ANYTHING


def _boolean(node: ast.BoolOp, inference: Inference) -> ValueType:
    return _common([_infer(value, inference) for value in node.values])


def _choice(node: ast.IfExp, inference: Inference) -> ValueType:
    _infer(node.test, inference)
    return _common([_infer(node.body, inference), _infer(node.orelse, inference)])


def _common(types: list[ValueType]) -> ValueType:
    if all(is_number(found) for found in types):
        return _common_number(types)
    return types[0] if all(found == types[0] for found in types) else ANYTHING


def _comparison(node: ast.Compare, inference: Inference) -> ValueType:
    if isinstance(node.ops[0], ast.In | ast.NotIn):
        _membership(node, inference)
        return BOOL
    sides = [(side, _comparable(side, inference)) for side in (node.left, *node.comparators)]
    for operator, ((_, left), (right_node, right)) in zip(node.ops, pairwise(sides), strict=True):
        kinds = {_kind(left), _kind(right)} - {""}
        if len(kinds) > 1:
            message = f"{described(left)} and {described(right)} are never equal"
            if not isinstance(operator, ast.Eq | ast.NotEq):
                message = f"{described(left)} and {described(right)} cannot be ordered"
            _report(right_node, inference, message)
    if isinstance(node.ops[0], ast.Eq | ast.NotEq):
        for (_, word), (other, _) in (sides, sides[::-1]):
            _word(word, other, inference)
    return BOOL


def _word(type_: ValueType, other: ast.expr, inference: Inference) -> None:
    """Check a constant that a string with few possible values is compared with."""
    if isinstance(type_, Word) and isinstance(other, ast.Constant):
        problem = type_.problem(other.value)
        if problem is not None:
            _report(other, inference, problem[0], problem[1])


def _comparable(node: ast.expr, inference: Inference) -> ValueType:
    found = _infer(node, inference)
    if found is ANYTHING or _kind(found):
        return found
    hint = "compare its fields or elements"
    return _report(node, inference, f"{described(found)} cannot be compared", hint)


def _kind(type_: ValueType) -> str:
    """Return "number", "string" or "bool"; "" for other and unknown types."""
    kinds = (("number", is_number), ("string", is_string), ("bool", is_bool))
    return next((kind for kind, belongs in kinds if belongs(type_)), "")


def _membership(node: ast.Compare, inference: Inference) -> None:
    item = _comparable(node.left, inference)
    container = node.comparators[0]
    if isinstance(container, ast.Tuple | ast.List):
        kinds = {_kind(_element_type(element, inference)) for element in container.elts}
        if _kind(item) and _kind(item) not in kinds:
            _report(node.left, inference, f"{described(item)} is never in this list")
        for element in container.elts:
            _word(item, element, inference)
        return
    found = _infer(container, inference)
    if found is ANYTHING or is_string(found) or is_array(found):
        return
    _report(container, inference, f"{described(found)} is neither a list nor a string")


def _element_type(node: ast.expr, inference: Inference) -> ValueType:
    return _infer(node.operand if isinstance(node, ast.UnaryOp) else node, inference)


def _call(node: ast.Call, inference: Inference) -> ValueType:
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    if name == "len":
        return _length(node.args[0], inference)
    if name in _CONVERSIONS:
        return _conversion(name, node.args[0], inference)
    if name in ("min", "max") and len(node.args) == 1:
        return _extremum_of_list(node.args[0], inference)
    arguments = [_number(argument, inference) for argument in node.args]
    if name in ("abs", "clamp", "min", "max"):
        return _common_number(arguments)
    if name == "round":
        return INTEGER if len(arguments) == 1 else _common_number(arguments[:1])
    return INTEGER if name in ("floor", "ceil") else NUMBER


def _length(argument: ast.expr, inference: Inference) -> ValueType:
    found = _infer(argument, inference)
    if not (found is ANYTHING or is_string(found) or is_array(found)):
        _report(argument, inference, f"{described(found)} has no length")
    return INTEGER


def _conversion(name: str, argument: ast.expr, inference: Inference) -> ValueType:
    found = _comparable(argument, inference)
    if name == "bool" and is_string(found):
        _report(argument, inference, f"{described(found)} where a number is expected")
    return _CONVERSIONS[name]


def _extremum_of_list(argument: ast.expr, inference: Inference) -> ValueType:
    found = _infer(argument, inference)
    if isinstance(found, FieldType) and found.is_array:
        if is_number(found.element):
            return _common_number([found.element])
    elif found is ANYTHING or is_number(found):
        return found
    return _report(argument, inference, f"{described(found)} where numbers are expected")


def _report(
    node: ast.expr, inference: Inference, message: str, hint: str | None = None
) -> ValueType:
    end = node.end_col_offset if node.end_col_offset is not None else node.col_offset + 1
    inside = range(node.col_offset, end)
    if any(offset in inside for offset in inference.offsets):
        return ANYTHING  # it follows from that
    return inference.report(node.col_offset, len(inside), message, hint)


_RULES: Mapping[type[ast.expr], Callable[[Any, Inference], ValueType]] = {
    ast.Attribute: _path,
    ast.BinOp: _arithmetic,
    ast.BoolOp: _boolean,
    ast.Call: _call,
    ast.Compare: _comparison,
    ast.Constant: _constant,
    ast.IfExp: _choice,
    ast.Name: _name,
    ast.Subscript: _path,
    ast.UnaryOp: _unary,
}
