"""The type of an expression's value, worked out from its syntax and the types of the names."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from composer.diagnostics import suggestion
from composer.expressions import CONSTANTS, Expression, FieldPath, path_of
from composer.field_types.types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    TEXT,
    PathProblem,
    Scope,
    ValueType,
    described,
    is_array,
    is_bool,
    is_integer,
    is_number,
    is_text,
    resolve_path,
)
from composer.interfaces import FieldType, Interfaces

_CONVERSIONS: Mapping[str, ValueType] = {
    "bool": BOOL,
    "float": NUMBER,
    "int": INTEGER,
    "str": TEXT,
}


@dataclass(frozen=True, slots=True)
class Complaint:
    """What is wrong with a part of an expression, in characters of its source."""

    message: str
    offset: int
    length: int
    hint: str | None = None
    missing: bool = False


@dataclass(slots=True)
class Inference:
    """The type of one expression's value, and what was found wrong on the way to it."""

    interfaces: Interfaces
    scope: Scope
    complaints: list[Complaint] = field(default_factory=list)


def infer(
    expression: Expression, scope: Scope, interfaces: Interfaces
) -> tuple[ValueType, list[Complaint]]:
    """Return the type of the expression's value, and all that cannot work in it."""
    inference = Inference(interfaces, scope)
    return _infer(expression.tree, inference), inference.complaints


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
            return TEXT


def _name(node: ast.Name, inference: Inference) -> ValueType:
    if node.id in CONSTANTS:
        return BOOL if isinstance(CONSTANTS[node.id], bool) else NUMBER
    return _path(node, inference)


def _path(node: ast.expr, inference: Inference) -> ValueType:
    path = path_of(node)
    if path.root not in inference.scope:
        hint = suggestion(path.root, inference.scope)
        message = f"there is no '{path.root}' here"
        inference.complaints.append(
            Complaint(message, path.offset, len(path.root), hint, missing=True)
        )
        return ANYTHING
    found = resolve_path(inference.scope[path.root], path.parts[1:], inference.interfaces)
    if isinstance(found, PathProblem):
        offset, length = _part(path, found.index + 1)
        complaint = Complaint(found.message, offset, length, found.hint, missing=True)
        inference.complaints.append(complaint)
        return ANYTHING
    return found


def _part(path: FieldPath, index: int) -> tuple[int, int]:
    """Return offset and length of one part of a path; of all of it where it has spaces in it."""
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
    """Return the type of an operand, which must be a number."""
    found = _infer(node, inference)
    if found is ANYTHING or is_number(found):
        return found
    hint = None
    if is_text(found):
        hint = "use float(...), or several {...} in a text to join texts"
    elif is_bool(found):
        hint = "use int(...)"
    return _complain(node, inference, f"{described(found)} where a number is expected", hint)


def _common_number(types: list[ValueType]) -> ValueType:
    if any(not is_integer(found) and is_number(found) for found in types):
        return NUMBER
    return INTEGER if all(is_integer(found) for found in types) else ANYTHING


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
                message = f"{described(left)} and {described(right)} have no order"
            _complain(right_node, inference, message)
    return BOOL


def _comparable(node: ast.expr, inference: Inference) -> ValueType:
    found = _infer(node, inference)
    if found is ANYTHING or _kind(found):
        return found
    hint = "compare its fields or elements"
    return _complain(node, inference, f"{described(found)} cannot be compared", hint)


def _kind(type_: ValueType) -> str:
    """Return number, text or bool; nothing where the type is none of them or not known."""
    kinds = (("number", is_number), ("text", is_text), ("bool", is_bool))
    return next((kind for kind, belongs in kinds if belongs(type_)), "")


def _membership(node: ast.Compare, inference: Inference) -> None:
    item = _comparable(node.left, inference)
    container = node.comparators[0]
    if isinstance(container, ast.Tuple | ast.List):
        kinds = {_kind(_literal(element, inference)) for element in container.elts}
        if _kind(item) and _kind(item) not in kinds:
            _complain(node.left, inference, f"{described(item)} is never in this list")
        return
    found = _infer(container, inference)
    if found is ANYTHING or is_text(found) or is_array(found):
        return
    _complain(container, inference, f"{described(found)} is neither a list nor a text")


def _literal(node: ast.expr, inference: Inference) -> ValueType:
    return _infer(node.operand if isinstance(node, ast.UnaryOp) else node, inference)


def _call(node: ast.Call, inference: Inference) -> ValueType:
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    if name == "len":
        return _length(node.args[0], inference)
    if name in _CONVERSIONS:
        return _conversion(name, node.args[0], inference)
    if name in ("min", "max") and len(node.args) == 1:
        return _extreme_of_list(node.args[0], inference)
    arguments = [_number(argument, inference) for argument in node.args]
    if name in ("abs", "clamp", "min", "max"):
        return _common_number(arguments)
    if name == "round":
        return INTEGER if len(arguments) == 1 else _common_number(arguments[:1])
    return INTEGER if name in ("floor", "ceil") else NUMBER


def _length(argument: ast.expr, inference: Inference) -> ValueType:
    found = _infer(argument, inference)
    if not (found is ANYTHING or is_text(found) or is_array(found)):
        _complain(argument, inference, f"{described(found)} has no length")
    return INTEGER


def _conversion(name: str, argument: ast.expr, inference: Inference) -> ValueType:
    found = _comparable(argument, inference)
    if name == "bool" and is_text(found):
        _complain(argument, inference, f"{described(found)} where a number is expected")
    return _CONVERSIONS[name]


def _extreme_of_list(argument: ast.expr, inference: Inference) -> ValueType:
    found = _infer(argument, inference)
    if isinstance(found, FieldType) and found.is_array:
        if is_number(found.element):
            return _common_number([found.element])
    elif found is ANYTHING or is_number(found):
        return found
    return _complain(argument, inference, f"{described(found)} where numbers are expected")


def _complain(
    node: ast.expr, inference: Inference, message: str, hint: str | None = None
) -> ValueType:
    end = node.end_col_offset if node.end_col_offset is not None else node.col_offset + 1
    length = end - node.col_offset
    inference.complaints.append(Complaint(message, node.col_offset, length, hint))
    return ANYTHING


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
