"""Finds values of parameters for which ``on_configure`` always raises."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterator, Mapping

from composer.behavior_checks.messages.elements import parameter_read
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_source.traversal import walk
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.syntax.names import constant_named

_COMPARISONS: Mapping[type[ast.cmpop], Callable[[object, object], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,  # type: ignore[dict-item]  # numbers are compared
    ast.LtE: operator.le,  # type: ignore[dict-item]
    ast.Gt: operator.gt,  # type: ignore[dict-item]
    ast.GtE: operator.ge,  # type: ignore[dict-item]
}


class _UnknownValue(Exception):
    """An expression depends on more than parameters."""


def refused_parameters(types: BehaviorTypes) -> Iterator[tuple[frozenset[str], CodeProblem]]:
    """Yield the check of parameters that fails, and their names."""
    for home, known in types.source.own_classes:
        for method in known.methods:
            scope = types.scope(method, home) if method.name == "on_configure" else None
            for statement in method.node.body if scope is not None and method.node else ():
                match statement:
                    case ast.If(test=test, body=[*_, ast.Raise()], orelse=[]):
                        is_refused = True
                    case ast.Assert(test=test):
                        is_refused = False
                    case _ if any(isinstance(node, ast.Return) for node in walk([statement])):
                        break
                    case _:
                        continue
                names: set[str] = set()
                if scope is not None and _is(test, names, scope, is_refused):
                    message = "the values of the parameters make 'on_configure' fail here"
                    span = span_of(test, home.source)
                    yield frozenset(names), CodeProblem(Kind.REFUSED, message, span)
                    return


def _is(test: ast.expr, names: set[str], scope: FunctionTypes, expected: bool) -> bool:
    try:
        found = _value(test, names, scope)
    except (_UnknownValue, TypeError):
        return False
    return bool(names) and bool(found) is expected


def _value(node: ast.expr, names: set[str], scope: FunctionTypes) -> object:
    """Return the value of an expression; ``names`` gets the parameters that it reads."""
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name) if not scope.is_local(name):
            constant = constant_named(name, scope.home)
            if isinstance(constant, ast.Constant):
                return constant.value
        case ast.Attribute():
            parameter = parameter_read(node, scope)
            if parameter is not None and parameter.value is not None:
                names.add(parameter.name.value)
                return parameter.value.value
        case ast.Call(func=ast.Name(id="len"), args=[only], keywords=[]):
            measured = _value(only, names, scope)
            if isinstance(measured, list | str):
                return len(measured)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not _value(operand, names, scope)
        case ast.BoolOp(op=ast.Or(), values=values):
            return any(_value(item, names, scope) for item in values)
        case ast.BoolOp(values=values):
            return all(_value(item, names, scope) for item in values)
        case ast.Compare(left=left, ops=[sign], comparators=[right]):
            compare = _COMPARISONS.get(type(sign))
            if compare is not None:
                return compare(_value(left, names, scope), _value(right, names, scope))
    raise _UnknownValue
