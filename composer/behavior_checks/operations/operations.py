"""Checks operations, calls and statements that fail or have no effect."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from composer.behavior_checks.calls.standard_calls import library_call_problems
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.operations.caught import exception_class, unreachable_handlers
from composer.behavior_checks.operations.formats import percent_problem
from composer.behavior_checks.operations.membership import CONVERSIONS, conversion_problems
from composer.behavior_checks.parts import is_only_none, uses_numpy
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function, Module
from composer.behavior_source.flow import returned_values
from composer.behavior_source.method_body import argument as given
from composer.behavior_source.method_body import dotted
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.annotations import annotated
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.operators import (
    binary,
    equality_problem,
    operation_problem,
    order_problem,
    unary_problem,
)
from composer.behavior_types.functions import is_function
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.libraries.standard_types import ITERATORS
from composer.behavior_types.scalars import is_float, is_integer, is_number, is_scalar, is_text
from composer.behavior_types.syntax.literals import integer_constant
from composer.behavior_types.values import (
    Collection,
    Parameters,
    Self,
    Value,
)
from composer.field_types import ANYTHING, Word, described
from composer.interfaces import FieldType, Message


def annotations_by_name(
    function: Function, home: Module, types: BehaviorTypes
) -> Mapping[str, Value]:
    """Return the types that the annotations of the parameters of a function name."""
    arguments = function.args
    return {
        argument.arg: annotated(argument.annotation, home, types.node, types.interfaces)
        for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
        if argument.annotation is not None
    }


def annotations_of(function: Function) -> Iterator[ast.expr]:
    """Yield the annotations of the parameters and of the result of a function."""
    arguments = function.args
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        if argument.annotation is not None:
            yield argument.annotation
    if function.returns is not None:
        yield function.returns


def operation_problems(node: ast.AST, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the problems of an operation or a statement."""
    source = scope.home.source
    match node:
        case ast.BinOp():
            yield from _calculation(node, scope)
        case ast.UnaryOp(op=operator, operand=operand):
            problem = unary_problem(operator, scope.type_of(operand))
            if problem is not None:
                yield CodeProblem(Kind.VALUE, problem, span_of(node, source))
        case ast.AugAssign():
            yield from _changed(node, scope)
        case ast.Subscript(value=owner, slice=index):
            problem = _owner_problem(scope.type_of(owner))
            about = dotted(owner) if problem is not None else ""
            problem = problem or _index_problem(scope.type_of(owner), scope.type_of(index))
            problem = problem or _position_problem(scope.type_of(owner), index)
            if problem is not None:
                yield CodeProblem(Kind.VALUE, problem, span_of(index, source), about=about)
            elif uses_numpy(scope.home):
                yield from _index_of_array(node, scope)
        case ast.Call(func=ast.Name(id="len"), args=[argument]):
            found = scope.type_of(argument)
            if _has_no_length(found):
                message, about = f"{shown(found)} has no length", dotted(argument)
                yield CodeProblem(Kind.VALUE, message, span_of(argument, source), about=about)
        case ast.Compare(left=left, ops=[ast.Eq() | ast.NotEq()], comparators=[right]):
            yield from _equality(left, right, node, scope)
        case ast.Compare(left=left, ops=operators, comparators=others):
            values = [scope.type_of(item) for item in (left, *others)]
            for (first, second), sign in zip(pairwise(values), operators, strict=True):
                problem = order_problem(first, sign, second)
                if problem is not None:
                    yield CodeProblem(Kind.VALUE, problem, span_of(node, source))
        case ast.Call(func=function) if called := scope.called_name(function):
            if called in CONVERSIONS:
                yield from conversion_problems(node, called, scope)
            yield from library_call_problems(node, called, scope)
        case ast.Try():
            yield from unreachable_handlers(node, scope)
        case ast.Expr(value=value):
            yield from _unused(value, scope)
        case ast.Await(value=ast.Call(func=function) as call) if not _lets_others_run(call):
            name = scope.global_name(dotted(function))
            if name.startswith("asyncio.") and not _runs_asyncio(scope.home):
                message = f"'{name}' needs the event loop of asyncio, which does not run here"
                hint = "use self.clock.sleep" if name == "asyncio.sleep" else None
                yield CodeProblem(Kind.ASYNCIO, message, span_of(function, source), hint)


def _shape_problem(
    left: ast.expr, operator: ast.operator, right: ast.expr, scope: FunctionTypes
) -> str | None:
    """Return why the shapes of two arrays of numpy do not allow an operation."""
    if not uses_numpy(scope.home):
        return None
    from composer.behavior_checks.operations.shape_problems import (  # noqa: PLC0415 (start-up time)
        operation_on_shapes,
        product_problem,
    )

    is_product = isinstance(operator, ast.MatMult)
    return (product_problem if is_product else operation_on_shapes)(left, right, scope)


def _index_of_array(node: ast.Subscript, scope: FunctionTypes) -> Iterator[CodeProblem]:
    from composer.behavior_checks.operations.shape_problems import (  # noqa: PLC0415 (start-up time)
        index_on_shape,
    )

    found = index_on_shape(node, scope)
    if found is not None:
        span, about = span_of(found[1], scope.home.source), dotted(node.value)
        yield CodeProblem(Kind.INDEX, found[0], span, about=about)


def _calculation(node: ast.BinOp, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why an arithmetic operation fails."""
    left, operator, right = node.left, node.op, node.right
    source = scope.home.source
    problem = operation_problem(scope.type_of(left), operator, scope.type_of(right))
    problem = problem or percent_problem(left, operator, right, scope)
    problem = problem or _problem_of_array(left, operator, right, scope)
    problem = problem or _shape_problem(left, operator, right, scope)
    if problem is not None:
        first = left.operand if isinstance(left, ast.UnaryOp) else left
        about = blamed_name((left, right), scope) or dotted(first)
        place = uncalled(left, scope) or uncalled(right, scope) or node
        yield CodeProblem(Kind.VALUE, problem, span_of(place, source), about=about)


def _problem_of_array(
    left: ast.expr, operator: ast.operator, right: ast.expr, scope: FunctionTypes
) -> str | None:
    """Return why an array in a message, which is none of numpy, is not calculated with a number."""
    for array, number in ((left, right), (right, left)):
        if not isinstance(array, ast.Attribute) or not _is_plain_number(number, scope):
            continue
        found, value = scope.type_of(array), scope.type_of(number)
        is_repeated = isinstance(operator, ast.Mult) and not is_float(value)
        if isinstance(operator, ast.MatMult) or is_repeated or not isinstance(found, FieldType):
            continue
        # a field of a fixed size is an array of numpy; all others are arrays of Python
        is_plain = found.is_array and found.array_size is None and is_number(found.element)
        if is_plain and isinstance(scope.type_of(array.value), Message):
            return f"{described(found)} is a list: it cannot be calculated with as a whole"
    return None


def _is_plain_number(node: ast.expr, scope: FunctionTypes) -> bool:
    """Return whether a value is a number of Python: one of numpy calculates with lists."""
    match node:
        case ast.UnaryOp(operand=operand):
            return _is_plain_number(operand, scope)
        case ast.Constant(value=int() | float()):
            return True
        case ast.Attribute(value=owner):
            return isinstance(scope.type_of(owner), Parameters) and is_number(scope.type_of(node))
        case ast.Call(func=function):
            return scope.called_name(function) in {"float", "int", "len"}
        case _:
            return False


def _changed(node: ast.AugAssign, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why '+=' and the like fail."""
    if isinstance(node.target, ast.Attribute) and is_only_none(node.target, scope):
        message = f"'{ast.unparse(node.target)}' is None: nothing else is assigned to it"
        yield CodeProblem(Kind.NONE, message, span_of(node.target, scope.home.source))
        return
    changed = scope.type_of(node.target)
    if changed is ANYTHING:
        before = before_changes(node.target, scope)
        changed = before if is_scalar(before) or isinstance(before, Message) else ANYTHING
    problem = operation_problem(changed, node.op, scope.type_of(node.value))
    is_array = isinstance(changed, FieldType) and changed.is_array
    if problem is None and isinstance(node.target, ast.Attribute):
        owner = scope.type_of(node.target.value)
        result = binary(changed, node.op, scope.type_of(node.value))
        if isinstance(owner, Message) and is_integer(changed) and is_float(result):
            problem = f"a float where {shown(changed)} is expected"
    if problem is not None and not is_array and not isinstance(changed, Collection):
        yield CodeProblem(Kind.VALUE, problem, span_of(node.value, scope.home.source))


def before_changes(target: ast.expr, scope: FunctionTypes) -> Value:
    """Return the type of a name or an attribute without what '+=' and the like do to it."""
    if isinstance(target, ast.Name):
        return scope.before_changes(target.id)
    if isinstance(target, ast.Attribute) and isinstance(scope.type_of(target.value), Self):
        return scope.owner.before_changes(target.attr)
    return ANYTHING


def _equality(
    left: ast.expr, right: ast.expr, node: ast.expr, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield why a value is never equal to the other one."""
    source = scope.home.source
    for word, other in ((scope.type_of(left), right), (scope.type_of(right), left)):
        constant = other.value if isinstance(other, ast.Constant) else None
        never = word.problem(constant) if isinstance(word, Word) else None
        if never is not None:
            yield CodeProblem(Kind.VALUE, never[0], span_of(other, source), never[1])
    problem = equality_problem(scope.type_of(left), scope.type_of(right))
    if problem is not None:
        yield CodeProblem(Kind.VALUE, problem, span_of(node, source))


def uncalled(node: ast.expr, scope: FunctionTypes) -> ast.expr | None:
    """Return the method that a name means as in ``now = clock.now``: '()' is missing."""
    value = scope.bindings.value_of(node.id) if isinstance(node, ast.Name) else None
    is_method = isinstance(value, ast.Attribute) and is_function(scope.type_of(value))
    return value if is_method else None


def blamed_name(operands: Sequence[ast.expr], scope: FunctionTypes) -> str:
    """Return the name of the operand that is not a number, "" if it has none."""
    for operand in operands:
        if isinstance(operand, ast.Name) and kind_of(scope.type_of(operand)) not in (
            None,
            "number",
        ):
            return operand.id
    return ""


def returned_exceptions(function: Function, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the exceptions that a function returns although its result is not used."""
    returns = function.returns
    if returns is None and not function.name.startswith("on_"):
        return
    if returns is not None and not (isinstance(returns, ast.Constant) and returns.value is None):
        return
    for value in returned_values(function):
        if isinstance(value, ast.Call) and _is_exception(scope.called_name(value.func)):
            message = "an exception is returned, not raised"
            span = span_of(value, scope.home.source)
            yield CodeProblem(Kind.UNUSED, message, span, "write 'raise' instead of 'return'")


def _is_exception(name: str) -> bool:
    found = exception_class(name)
    return found is not None and issubclass(found, Exception)


def _lets_others_run(call: ast.Call) -> bool:
    """Return whether a call is ``asyncio.sleep(0)``, which needs no event loop of asyncio."""
    delay = given(call, 0, "delay")
    return isinstance(delay, ast.Constant) and delay.value == 0


def _runs_asyncio(home: Module) -> bool:
    """Return whether a file may run an event loop of asyncio, such as in a thread."""
    starts = ("asyncio.run(", "run_until_complete", "run_forever", "asyncio.Runner")
    return any(start in home.source.text for start in starts)


def _index_problem(owner: Value, index: Value) -> str | None:
    is_list = isinstance(owner, FieldType) and owner.is_array
    is_sequence = isinstance(owner, Collection) and owner.python in (list, tuple, bytes)
    is_ordered = is_list or is_sequence or is_text(owner)
    if is_ordered and is_float(index):
        return "an index must be an integer, not a float"
    if is_ordered and (is_text(index) or isinstance(index, Message) or is_function(index)):
        return f"an index must be an integer, not {shown(index)}"
    return None


def _owner_problem(owner: Value) -> str | None:
    if is_function(owner):
        return "a function has no items: call it"
    if isinstance(owner, Message) or (is_scalar(owner) and not is_text(owner)):
        return f"{described(owner)} is not a list"  # type: ignore[arg-type]
    return None


def _position_problem(owner: Value, index: ast.expr) -> str | None:
    """Return why a tuple of a known length has no item at a position."""
    items = owner.items if isinstance(owner, Collection) and owner.python is tuple else None
    position = integer_constant(index)
    if items is None or position is None or -len(items) <= position < len(items):
        return None
    return f"{shown(owner)} has no item {position}"


def _has_no_length(type_: Value) -> bool:
    if isinstance(type_, Collection):
        return type_.python in ITERATORS or type_.python is Iterator
    if is_function(type_) or isinstance(type_, Message):
        return True
    return is_scalar(type_) and not is_text(type_)


def _unused(value: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    source = scope.home.source
    match value:
        case ast.Compare(ops=[ast.Eq(), *_]):
            message = "the result of this comparison is not used"
            yield CodeProblem(Kind.UNUSED, message, span_of(value, source), "assign with '='")
        case ast.Attribute(attr=name) | ast.Name(id=name):
            found = scope.type_of(value)
            if is_function(found):
                message = f"'{name}' is not called"
                yield CodeProblem(Kind.UNUSED, message, span_of(value, source), "add '()'")
