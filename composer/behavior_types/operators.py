"""The types of operators and built-in functions, and operators that fail."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from composer.behavior_types.values import NONE, Collection, Value, join_all
from composer.field_types import ANYTHING, BOOL, INTEGER, NUMBER, STRING
from composer.interfaces import FLOATS, INTEGER_RANGES, FieldType, Message

_TO_INTEGER = frozenset({"ceil", "comb", "factorial", "floor", "gcd", "isqrt", "lcm", "trunc"})
_TO_BOOL = frozenset({"isclose", "isfinite", "isinf", "isnan"})
_TO_OTHER = frozenset({"frexp", "modf", "perm", "prod", "sumprod"})
_CONVERSIONS = {
    "str": STRING,
    "repr": STRING,
    "int": INTEGER,
    "len": INTEGER,
    "float": NUMBER,
    "bool": BOOL,
    "isinstance": BOOL,
    "any": BOOL,
    "all": BOOL,
}
_COLLECTIONS: dict[str, type] = {
    "list": list,
    "sorted": list,
    "tuple": tuple,
    "set": set,
    "frozenset": frozenset,
    "dict": dict,
    "bytes": bytes,
    "bytearray": bytearray,
}


def is_scalar(type_: Value, names: frozenset[str] | None = None) -> bool:
    """Return whether a type is a single number, text or bool, of one of ``names`` if given."""
    if not isinstance(type_, FieldType) or type_.is_array or not type_.is_primitive:
        return False
    return type_.name != "byte" and (names is None or type_.name in names)


_INTEGERS = frozenset(INTEGER_RANGES) - {"byte"}
_TEXTS = frozenset({"string", "wstring"})


def is_integer(type_: Value) -> bool:
    """Return whether values of a type are ints of Python."""
    return is_scalar(type_, _INTEGERS)


def is_float(type_: Value) -> bool:
    """Return whether values of a type are floats of Python."""
    return is_scalar(type_, FLOATS)


def is_number(type_: Value) -> bool:
    """Return whether Python calculates with values of a type, as it does with bools."""
    return is_integer(type_) or is_float(type_) or type_ == BOOL


def is_text(type_: Value) -> bool:
    """Return whether values of a type are strings of Python."""
    return is_scalar(type_, _TEXTS)


def binary(left: Value, operator: ast.operator, right: Value) -> Value:
    """Return the type of an arithmetic operation."""
    if is_number(left) and is_number(right):
        return _arithmetic(left, operator, right)
    if is_text(left) and (
        (isinstance(operator, ast.Add) and is_text(right))
        or (isinstance(operator, ast.Mult) and is_number(right))
        or isinstance(operator, ast.Mod)
    ):
        return STRING
    if isinstance(left, Collection) and left.python is not dict:
        if isinstance(operator, ast.Add) and isinstance(right, Collection):
            return join_all((left, right))
        if isinstance(operator, ast.Mult) and is_integer(right):
            return left
    return ANYTHING


def _arithmetic(left: Value, operator: ast.operator, right: Value) -> Value:
    if isinstance(operator, ast.Div) or is_float(left) or is_float(right):
        return NUMBER
    is_exact = isinstance(operator, ast.Add | ast.Sub | ast.Mult | ast.FloorDiv | ast.Mod)
    return INTEGER if is_exact else ANYTHING


def unary(operator: ast.unaryop, operand: Value) -> Value:
    """Return the type of ``-x``, ``not x`` and the like."""
    if isinstance(operator, ast.Not):
        return BOOL
    if isinstance(operator, ast.USub | ast.UAdd) and is_number(operand):
        return INTEGER if operand == BOOL else operand
    return ANYTHING


def comparison(operators: Sequence[ast.cmpop], operands: Sequence[Value]) -> Value:
    """Return the type of a comparison: a bool, unless an operand is of an unknown type."""
    if all(isinstance(item, ast.In | ast.NotIn | ast.Is | ast.IsNot) for item in operators):
        return BOOL
    known = (is_scalar(operand) or operand is NONE for operand in operands)
    return BOOL if all(known) else ANYTHING


def builtin_call(name: str, arguments: Sequence[Value]) -> Value:
    """Return the type of a call of a built-in function or of one in ``math``."""
    module, _, function = name.rpartition(".")
    if module == "math":
        return _math(function)
    if name == "range":
        return Collection(range, INTEGER)
    if name in _COLLECTIONS:
        source = arguments[0] if len(arguments) == 1 else ANYTHING
        of_dict = isinstance(source, Collection) and source.python is dict
        element = element_of(source) if name != "dict" and not of_dict else ANYTHING
        return Collection(_COLLECTIONS[name], element)
    if name in {"min", "max"} and len(arguments) > 1:
        return join_all(arguments)
    if name == "abs" and len(arguments) == 1 and is_number(arguments[0]):
        return arguments[0]
    if name == "round" and len(arguments) == 1 and is_number(arguments[0]):
        return INTEGER
    return _CONVERSIONS.get(name, ANYTHING)


def _math(function: str) -> Value:
    if function in _TO_OTHER:
        return ANYTHING
    if function in _TO_INTEGER:
        return INTEGER
    return BOOL if function in _TO_BOOL else NUMBER


def element_of(type_: Value) -> Value:
    """Return the type of what iterating over a value gives, as it is written in its type."""
    if isinstance(type_, Collection):
        return type_.key if type_.python is dict else type_.element
    if isinstance(type_, FieldType) and type_.is_array:
        return type_.element
    return ANYTHING


def operation_problem(left: Value, operator: ast.operator, right: Value) -> str | None:
    """Return why an operation on two values fails, or None if it may be right."""
    sign = _SIGNS.get(type(operator))
    if sign is None or ANYTHING in (left, right):
        return None
    for message in (left, right):
        if isinstance(message, Message):
            return f"{message.name} has no operator '{sign}'"
    is_sum = isinstance(operator, ast.Add | ast.Sub)
    if is_sum and ((is_text(left) and is_number(right)) or (is_number(left) and is_text(right))):
        return f"operator '{sign}' on a string and a number"
    return None


def order_problem(left: Value, operator: ast.cmpop, right: Value) -> str | None:
    """Return why Python cannot order two values, or None if it may."""
    if not isinstance(operator, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
        return None
    kinds = {_order(left), _order(right)}
    if len(kinds) > 1 and "" not in kinds:
        return "a comparison of " + " and ".join(sorted(kinds))
    return None


def _order(type_: Value) -> str:
    if is_number(type_):
        return "a number"
    if is_text(type_):
        return "a string"
    is_array = isinstance(type_, FieldType) and type_.is_array
    # numpy arrays, which messages may hold, can be compared with numbers
    is_list = is_array and isinstance(type_, FieldType) and type_.name in _TEXTS
    return "a list" if is_list or (isinstance(type_, Collection) and type_.python is list) else ""


_SIGNS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.FloorDiv: "//",
    ast.Mod: "%",
    ast.Pow: "**",
}
