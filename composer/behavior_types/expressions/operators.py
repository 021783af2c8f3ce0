"""The types of operators and built-in functions, and operators that fail."""

from __future__ import annotations

import ast
import operator as calculation
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, TypeGuard

from composer.behavior_types.functions import is_function
from composer.behavior_types.libraries.numpy_types import (
    ARRAY,
    array_comparison,
    array_operation,
)
from composer.behavior_types.libraries.rclpy_api import (
    is_rclpy,
    is_time,
    order_of_rclpy,
    time_arithmetic,
)
from composer.behavior_types.scalars import is_float, is_integer, is_number, is_scalar, is_text
from composer.behavior_types.syntax.lineage import NAMED_TUPLE, lineage
from composer.behavior_types.syntax.own_classes import (
    defines,
    is_enumeration,
    is_plain,
    known_attributes,
)
from composer.behavior_types.values import (
    NONE,
    Collection,
    OwnObject,
    Value,
    join_all,
)
from composer.field_types import ANYTHING, BOOL, INTEGER, NUMBER, STRING
from composer.interfaces import TEXTS, FieldType, Message


def binary(left: Value, operator: ast.operator, right: Value) -> Value:
    """Return the type of an arithmetic operation."""
    if is_number(left) and is_number(right):
        return _arithmetic(left, operator, right)
    of_array = array_operation(left, operator, right)
    if of_array is not None:
        return of_array
    if isinstance(operator, ast.Add | ast.Sub) and (is_time(left) or is_time(right)):
        return time_arithmetic(left, _SIGNS[type(operator)], right)
    if is_text(left) and (
        (isinstance(operator, ast.Add) and is_text(right)) or isinstance(operator, ast.Mod)
    ):
        return STRING
    if isinstance(left, Collection) and isinstance(right, Collection) and left.python is not dict:
        joined = join_all((left, right)) if isinstance(operator, ast.Add) else ANYTHING
        if isinstance(joined, Collection) and joined.items is not None:
            return Collection(tuple, joined.element)
        return joined
    if isinstance(operator, ast.Mult):
        return _repeated(left, right)
    return ANYTHING


def _repeated(left: Value, right: Value) -> Value:
    """Return the type of a text, a list or a tuple that is repeated."""
    for value, count in ((left, right), (right, left)):
        if _is_count(count) and isinstance(value, Collection) and value.python is not dict:
            return Collection(value.python, value.element, is_empty=value.is_empty)
        if _is_count(count) and is_text(value):
            return STRING
    return ANYTHING


def _is_count(type_: Value) -> bool:
    """Return whether a value can say how often something is repeated: an int or a bool."""
    return is_integer(type_) or type_ == BOOL


def _arithmetic(left: Value, operator: ast.operator, right: Value) -> Value:
    if isinstance(operator, ast.Div) or is_float(left) or is_float(right):
        return NUMBER
    if isinstance(operator, ast.BitAnd | ast.BitOr | ast.BitXor) and BOOL in (left, right):
        return ANYTHING
    return ANYTHING if isinstance(operator, ast.Pow | ast.MatMult) else INTEGER


def unary(operator: ast.unaryop, operand: Value) -> Value:
    """Return the type of ``-x``, ``not x`` and the like."""
    if isinstance(operator, ast.Not):
        return BOOL
    if isinstance(operator, ast.USub | ast.UAdd) and is_number(operand):
        return INTEGER if operand == BOOL else operand
    return ARRAY if operand == ARRAY else ANYTHING


def both(operator: ast.boolop, operands: Sequence[Value]) -> Value:
    """Return the type of ``a and b`` or ``a or b``."""
    if isinstance(operator, ast.Or):
        return join_all(operands)
    *first, last = operands
    # a message is never false
    possible = [*(item for item in first if not isinstance(item, Message)), last]
    return ANYTHING if NONE in possible else join_all(possible)


def comparison(operators: Sequence[ast.cmpop], operands: Sequence[Value]) -> Value:
    """Return the type of a comparison: a bool, unless an operand is an array or unknown."""
    others = (ast.In, ast.NotIn, ast.Is, ast.IsNot)
    if all(isinstance(item, others) for item in operators):
        return BOOL
    if all(is_scalar(operand) or operand is NONE for operand in operands):
        return BOOL
    has_other = any(isinstance(item, others) for item in operators)
    return ANYTHING if has_other else array_comparison(operands)


def operation_problem(left: Value, operator: ast.operator, right: Value) -> str | None:
    """Return why an operation on two values fails, or None if it may be right."""
    sign = _SIGNS.get(type(operator))
    if sign is None:
        return None
    if isinstance(operator, ast.Mod) and left is ANYTHING:
        return None
    for value in (left, right):
        if isinstance(value, Message) and ANYTHING in (left, right):
            return f"{value.name} has no operator '{sign}'"
        if is_function(value) and ANYTHING in (left, right):
            return f"a function has no operator '{sign}'"
    if ANYTHING in (left, right):
        return None
    if isinstance(operator, ast.Mod) and is_text(left):
        return None  # it formats any value
    for value in (left, right):
        if isinstance(value, Message):
            return f"{value.name} has no operator '{sign}'"
        if is_function(value):
            return f"a function has no operator '{sign}'"
    if is_time(left) or is_time(right):
        return _problem_of_times(left, sign, right)
    name = NAMES[type(operator)]
    is_defined = _defines(left, f"__{name}__") or _defines(right, f"__r{name}__")
    for value in (left, right):
        if isinstance(value, OwnObject) and not is_defined and is_plain(value.of):
            return f"a {value.of.definition.name} has no operator '{sign}'"
        if _is_tuple(value) and sign not in _OF_TUPLES and not _has_own(left, right, name):
            return f"a {value.of.definition.name} has no operator '{sign}'"
    return _problem_of_samples(left, operator, right)


def _problem_of_samples(left: Value, operator: ast.operator, right: Value) -> str | None:
    """Return why Python itself has no such operator for values of two of its types."""
    samples = _sample(left), _sample(right)
    if samples[0] is None or samples[1] is None:
        return None
    try:
        _FUNCTIONS[type(operator)](*samples)
    except TypeError:
        pass
    except (ArithmeticError, ValueError):
        return None
    else:
        return None
    sign = _SIGNS[type(operator)]
    first, second = (_sampled(item) for item in samples)
    if first == second == "a number":
        return f"operator '{sign}' on a float"
    if first == second:
        return f"operator '{sign}' on two {second.removeprefix('a ')}s"
    if first == "a number":
        first, second = second, first
    return f"operator '{sign}' on {first} and {second}"


def _sample(value: Value) -> object:
    """Return a value of a type of Python, None for other types; numpy has operators for most."""
    if value == BOOL:
        return True
    if is_number(value):
        return 1 if is_integer(value) else 1.0
    if is_text(value):
        return "a"
    return _OF_COLLECTIONS.get(value.python) if isinstance(value, Collection) else None


def _sampled(sample: object) -> str:
    if isinstance(sample, int | float):
        return "a number"
    return "a string" if isinstance(sample, str) else f"a {type(sample).__name__}"


def unary_problem(operator: ast.unaryop, operand: Value) -> str | None:
    """Return why ``-x`` and the like fail, or None if they may be right."""
    sign = _UNARY.get(type(operator))
    if sign is None:
        return None
    sample = _sample(operand)
    is_wrong = sample is not None and not isinstance(sample, int | float)
    if is_wrong or (sign == "~" and isinstance(sample, float)):
        return f"operator '{sign}' on {_sampled(sample)}"
    if is_function(operand):
        return f"a function has no operator '{sign}'"
    return f"{operand.name} has no operator '{sign}'" if isinstance(operand, Message) else None


def _problem_of_times(left: Value, sign: str, right: Value) -> str | None:
    """Return why rclpy cannot calculate with two values, one of which is a Time or a Duration."""
    names = [order_of_rclpy(item) or _order(item) for item in (left, right)]
    if "" in names or time_arithmetic(left, sign, right) is not ANYTHING:
        return None
    return f"operator '{sign}' on {names[0]} and {names[1]}"


def _is_tuple(value: Value) -> TypeGuard[OwnObject]:
    """Return whether a value is a named tuple, or of a class that is derived from one."""
    return isinstance(value, OwnObject) and lineage(value.of).others == {NAMED_TUPLE}


def _has_own(left: Value, right: Value, name: str) -> bool:
    """Return whether a class may define an operator for two values."""
    for value, method in ((left, f"__{name}__"), (right, f"__r{name}__")):
        known = known_attributes(value.of) if isinstance(value, OwnObject) else frozenset()
        if known is None or method in known:
            return True
    return not all(
        is_number(value) or is_text(value) or _is_tuple(value) for value in (left, right)
    )


def _defines(value: Value, method: str) -> bool:
    """Return whether an object may define an operator."""
    if not isinstance(value, OwnObject):
        return False
    known = known_attributes(value.of) if is_plain(value.of) else None
    return known is None or method in known


def order_problem(left: Value, operator: ast.cmpop, right: Value) -> str | None:
    """Return why Python cannot order two values, or None if it may."""
    if not isinstance(operator, ast.Lt | ast.LtE | ast.Gt | ast.GtE):
        return None
    kinds = {order_of_rclpy(left) or _order(left), order_of_rclpy(right) or _order(right)}
    if len(kinds) > 1 and "" not in kinds:
        return "a comparison of " + " and ".join(sorted(kinds))
    return None


def equality_problem(left: Value, right: Value) -> str | None:
    """Return why two values are never equal, None if they may be."""
    for first, second in ((left, right), (right, left)):
        if isinstance(first, OwnObject) and _order(second) in _PLAIN and _equals_itself(first):
            return f"a {first.of.definition.name} is never equal to {_order(second)}"
        if isinstance(first, Message) and (is_number(second) or is_text(second)):
            return f"{first.name} is never equal to {_order(second)}"
        if is_function(first) and _order(second) not in (
            "",
            "a function",
        ):
            return f"a function is never equal to {_order(second)}"
    return None


_PLAIN = frozenset({"a dict", "a list", "a number", "a string", "a tuple"})


def _equals_itself(value: OwnObject) -> bool:
    """Return whether a value is a member of an enumeration, which equals nothing else."""
    of = value.of
    is_member = is_enumeration(of) and is_plain(of) and not is_rclpy(of.home)
    return is_member and not defines(of, "__eq__")


def _order(type_: Value) -> str:
    if is_number(type_):
        return "a number"
    if is_text(type_):
        return "a string"
    if isinstance(type_, Message):
        return type_.name
    if is_function(type_):
        return "a function"
    is_array = isinstance(type_, FieldType) and type_.is_array
    # numpy arrays, which messages may hold, can be compared with numbers
    is_list = is_array and isinstance(type_, FieldType) and type_.name in TEXTS
    if is_list:
        return "a list"
    if isinstance(type_, Collection) and type_.python in (list, tuple, dict):
        return f"a {type_.python.__name__}"
    if isinstance(type_, OwnObject) and is_plain(type_.of):
        return "" if _may_order(type_) else f"a {type_.of.definition.name}"
    return ""


def _may_order(type_: OwnObject) -> bool:
    """Return whether objects of a class may be compared with other values."""
    own = {method.name for method in type_.of.definition.methods}
    options = any(isinstance(item, ast.Call) for item in type_.of.definition.node.decorator_list)
    return options or bool(own & {"__lt__", "__le__", "__gt__", "__ge__"})


#: What tuples and numbers have in common; numpy takes tuples for arrays.
_OF_TUPLES = frozenset({"+", "*", "%"})
#: The names of the special methods of operators, without what is around them.
NAMES: dict[type[ast.operator], str] = {
    ast.Add: "add",
    ast.Sub: "sub",
    ast.MatMult: "matmul",
    ast.Mult: "mul",
    ast.Div: "truediv",
    ast.FloorDiv: "floordiv",
    ast.Mod: "mod",
    ast.Pow: "pow",
    ast.BitAnd: "and",
    ast.BitOr: "or",
    ast.BitXor: "xor",
    ast.LShift: "lshift",
    ast.RShift: "rshift",
}
_SIGNS: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.MatMult: "@",
    ast.Mult: "*",
    ast.Div: "/",
    ast.FloorDiv: "//",
    ast.Mod: "%",
    ast.Pow: "**",
    ast.BitAnd: "&",
    ast.BitOr: "|",
    ast.BitXor: "^",
    ast.LShift: "<<",
    ast.RShift: ">>",
}
_FUNCTIONS: dict[type[ast.operator], Callable[[Any, Any], object]] = {
    ast.Add: calculation.add,
    ast.Sub: calculation.sub,
    ast.MatMult: calculation.matmul,
    ast.Mult: calculation.mul,
    ast.Div: calculation.truediv,
    ast.FloorDiv: calculation.floordiv,
    ast.Mod: calculation.mod,
    ast.Pow: calculation.pow,
    ast.BitAnd: calculation.and_,
    ast.BitOr: calculation.or_,
    ast.BitXor: calculation.xor,
    ast.LShift: calculation.lshift,
    ast.RShift: calculation.rshift,
}
_UNARY: dict[type[ast.unaryop], str] = {ast.Invert: "~", ast.UAdd: "+", ast.USub: "-"}
_OF_COLLECTIONS: dict[type, object] = {
    bytes: b"",
    deque: deque(),
    dict: {},
    list: [],
    set: set(),
    tuple: (),
}
