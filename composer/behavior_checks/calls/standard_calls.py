"""Checks calls of built-in functions and of the standard library."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from itertools import pairwise

from composer.behavior_checks.calls.arguments import (
    fields_signature,
    library_signature,
    signature_of_function,
)
from composer.behavior_checks.calls.call import call_problems, function_problems, uncallable
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.method_body import argument
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import fields_expected
from composer.behavior_types.expressions.operators import operation_problem, order_problem
from composer.behavior_types.scalars import is_float
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.own_classes import is_dataclass
from composer.behavior_types.values import OwnObject
from composer.field_types import ANYTHING, INTEGER

#: Functions of math that do not take numbers only.
_OF_ITERABLES = frozenset({"math.dist", "math.fsum", "math.prod", "math.sumprod"})
_OF_NUMBERS = frozenset(f"math.{name}" for name in dir(math))
#: Modules whose functions take arguments of certain types.
_WITH_TYPES = frozenset({"bisect", "heapq", "numpy", "random", "statistics"})


def library_call_problems(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check a call of the built-in or imported function with that full name."""
    if name == "range":
        yield from _range(call, scope)
        return
    if name in {"functools.partial", "functools.partialmethod"}:
        yield from _partial(call, scope)
        return
    if name == "collections.deque":
        yield from _longest(call, scope)
    if name == "dataclasses.replace":
        yield from _replaced(call, scope)
        return
    if name in {"dataclasses.asdict", "dataclasses.astuple"}:
        yield from _converted(call, scope)
    signature = library_signature(name)
    if signature is not None:
        problems = list(call_problems(call, signature, scope))
        yield from problems
        if not problems and name.partition(".")[0] in _WITH_TYPES:
            from composer.behavior_checks.calls.library_arguments import (  # noqa: PLC0415 (start-up time)
                library_argument_problems,
            )

            yield from library_argument_problems(call, signature, scope)
    if name.startswith("numpy."):
        yield from shape_problems(call, name, scope)
    if name == "time.sleep" or name in _OF_NUMBERS:
        takes_numbers = name not in _OF_ITERABLES
        for item in call.args:
            found = scope.type_of(item)
            kind = kind_of(found)
            if takes_numbers and kind not in (None, "number"):
                message = f"{shown(found)} where a number is expected"
                yield CodeProblem(Kind.VALUE, message, span_of(item, scope.home.source))
            elif name == "math.dist" and kind == "number":
                message = f"{shown(found)} where the coordinates of a point are expected"
                yield CodeProblem(Kind.VALUE, message, span_of(item, scope.home.source))
                return  # the other point has the same cause
    yield from _called_functions(call, name, scope)
    if name == "sum" and len(call.args) == 1:
        element = scope.element(scope.type_of(call.args[0]))
        problem = operation_problem(INTEGER, ast.Add(), element)
        if problem is not None:
            yield CodeProblem(Kind.VALUE, problem, span_of(call.args[0], scope.home.source))
    if name in {"max", "min"} and len(call.args) > 1 and not call.keywords:
        for first, second in pairwise(map(scope.type_of, call.args)):
            problem = order_problem(first, ast.Lt(), second)
            if problem is not None:
                span = span_of(call, scope.home.source)
                yield CodeProblem(Kind.VALUE, problem, span)
                return


def shape_problems(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check the axis and the sizes that a function of numpy, or ``.method``, is called with."""
    from composer.behavior_checks.operations.shape_problems import (  # noqa: PLC0415 (start-up time)
        call_on_shapes,
    )

    problem = call_on_shapes(call, name, scope)
    if problem is not None:
        yield CodeProblem(Kind.VALUE, problem, span_of(call, scope.home.source))


def _called_functions(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check the functions that a built-in function calls: how many arguments they take."""
    if any(isinstance(item, ast.Starred) for item in call.args):
        return
    keys = [item.value for item in call.keywords if item.arg == "key"]
    if name in {"max", "min", "sorted"} and keys:
        yield from function_problems(keys[0], 1, scope)
    elif name in {"filter", "functools.reduce", "map"} and len(call.args) > 1:
        count = {"filter": 1, "functools.reduce": 2}.get(name, len(call.args) - 1)
        yield from function_problems(call.args[0], count, scope)


def _range(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    for item in call.args:
        found = scope.type_of(item)
        span = span_of(item, scope.home.source)
        if is_float(found):
            problem = "'range' takes integers, not a float"
            yield CodeProblem(Kind.VALUE, problem, span, "write int(...)")
        elif kind_of(found) in ("collection", "dict", "text", "function"):
            problem = f"'range' takes integers, not {shown(found)}"
            hint = None if kind_of(found) == "function" else "write range(len(...))"
            yield CodeProblem(Kind.VALUE, problem, span, hint)


def _longest(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check the length that ``deque`` is limited to."""
    limit = argument(call, 1, "maxlen")
    found = scope.type_of(limit) if limit is not None else ANYTHING
    if limit is not None and (is_float(found) or kind_of(found) not in (None, "number")):
        problem = f"'maxlen' is an integer, not {shown(found)}"
        yield CodeProblem(Kind.VALUE, problem, span_of(limit, scope.home.source))


def _replaced(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check the fields that ``dataclasses.replace`` sets."""
    found = scope.type_of(call.args[0]) if call.args else None
    if not isinstance(found, OwnObject) or not is_dataclass(found.of):
        return
    signature = fields_signature(found.of, "replace", first=True)
    if signature is not None:
        yield from call_problems(call, signature, scope, fields_expected(scope, found.of))


def _converted(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check what ``dataclasses.asdict`` and ``astuple`` convert."""
    found = scope.type_of(call.args[0]) if call.args else None
    is_right = isinstance(found, OwnObject) and any(map(is_dataclass, lineage(found.of).classes))
    if found is not None and not is_right and kind_of(found) is not None:
        span = span_of(call.args[0], scope.home.source)
        yield CodeProblem(Kind.VALUE, f"{shown(found)} where a dataclass is expected", span)


def _partial(call: ast.Call, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Check what ``functools.partial`` sets against the function; it may leave out arguments."""
    if not call.args or isinstance(call.args[0], ast.Starred):
        return
    reason = uncallable(scope.type_of(call.args[0]))
    if reason is not None:
        yield CodeProblem(Kind.CALL, reason[0], span_of(call.args[0], scope.home.source))
        return
    signature = signature_of_function(call.args[0], scope.type_of(call.args[0]))
    if signature is not None:
        given = ast.Call(func=call.func, args=call.args[1:], keywords=call.keywords)
        yield from call_problems(given, signature.partial(), scope)
