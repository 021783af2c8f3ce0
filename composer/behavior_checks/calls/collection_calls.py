"""Checks what is stored in lists, dicts and sets: by their methods, and by index."""

from __future__ import annotations

import ast
from collections import deque
from collections.abc import Iterator

from composer.behavior_checks.annotated_values import argument_problem
from composer.behavior_checks.calls.arguments import method_signature
from composer.behavior_checks.calls.call import call_problems, function_problems
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.parts import uses_numpy
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source.spans import span_of
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.libraries.standard_types import called
from composer.behavior_types.scalars import is_number, is_text
from composer.behavior_types.syntax.own_classes import defines
from composer.behavior_types.values import Collection, OwnObject, Parameters, Ports, Value
from composer.field_types import INTEGER, STRING
from composer.interfaces import FieldType, Message

#: The methods that store their last argument as an element.
_ADDING = frozenset({"add", "append", "appendleft", "insert"})
#: The methods of dicts and of sets that take a key first.
_KEYED = frozenset({"get", "pop", "setdefault"})
#: The methods that fail without an element that equals their first argument.
_SEARCHING = frozenset({"index", "remove"})
#: How many of the first arguments of methods of texts are texts.
_OF_TEXTS = {
    **dict.fromkeys(("count", "endswith", "find", "index", "lstrip", "partition"), 1),
    **dict.fromkeys(("removeprefix", "removesuffix", "rfind", "rpartition", "rsplit"), 1),
    **dict.fromkeys(("rstrip", "split", "startswith", "strip"), 1),
    "replace": 2,
}
_HASHING = frozenset({"add", "discard", "remove"})


def method_problems(
    call: ast.Call, owner: Collection, name: str, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield why a call of a method of a collection or of a text fails."""
    signature = method_signature(owner.python, name)
    found = list(call_problems(call, signature, scope)) if signature is not None else []
    yield from found
    keys = [item.value for item in call.keywords if item.arg == "key"]
    if (owner.python, name) == (list, "sort") and keys:
        yield from function_problems(keys[0], 1, scope)
    if found or not call.args:
        return
    if (name in _KEYED and owner.python is dict) or (
        name in _HASHING and owner.python in (set, frozenset)
    ):
        yield from key_problems(call.args[0], owner, scope)
    if name in _ADDING and owner.python is not dict:
        yield from _stored(call.args[-1], owner.element, f"'{name}'", scope)
    elif name == "extend" and owner.python in (list, deque):
        found_items = scope.element(scope.type_of(call.args[0]))
        wrong = argument_problem(None, found_items, owner.element, scope.type_of)
        if wrong is not None:
            span = span_of(call.args[0], scope.home.source)
            yield CodeProblem(Kind.VALUE, f"'extend': {wrong}", span)
    elif name == "pop" and owner.python is list:
        yield from _stored(call.args[0], INTEGER, "an index", scope)
    elif name in _OF_TEXTS and owner.python is str:
        yield from _text(call, name, scope)
    elif name in _SEARCHING and not _may_equal(owner, scope):
        yield from _stored(call.args[0], owner.element, f"'{name}' finds nothing", scope)
    elif name == "join" and owner.python is str:
        yield from _joined(call.args[0], scope)


def _may_equal(owner: Collection, scope: FunctionTypes) -> bool:
    """Return whether an element may be equal to a value of another class."""
    if owner.python not in (list, deque, tuple):
        return True
    if not isinstance(owner.element, OwnObject):
        return False
    of = owner.element.of
    classes = (of, *scope.owner.project_classes.derived(of))
    return any(defines(item, "__eq__") for item in classes)


def key_problems(node: ast.expr, owner: Collection, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield why a value cannot be a key of a dict or an element of a set."""
    found = scope.type_of(node)
    wrong = None
    if isinstance(found, Message):
        wrong = f"{found.name} cannot be a key"
    elif isinstance(found, Parameters | Ports):
        wrong = "this cannot be a key: name one of its attributes"
    elif isinstance(found, Collection) and found.python in (list, dict, set):
        wrong = f"{shown(found)} cannot be a key"
    elif owner.python is dict:
        wrong = argument_problem(node, found, owner.key, scope.type_of)
        wrong = f"this key: {wrong}" if wrong is not None else None
    if wrong is not None:
        yield CodeProblem(Kind.VALUE, wrong, span_of(node, scope.home.source))


def stored_problems(
    target: ast.Subscript, value: ast.expr, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    """Yield why a value does not belong into the list or dict that ``target`` is an item of."""
    owner = scope.type_of(target.value)
    if _is_record(target, scope):
        return
    if isinstance(owner, Collection) and not isinstance(target.slice, ast.Slice):
        yield from _stored(value, owner.element, "this item", scope)


def default_problem(node: ast.expr, expected: Value, scope: FunctionTypes) -> str | None:
    """Return why the values that ``defaultdict(...)`` makes contradict an annotation."""
    match node:
        case ast.Call(func=function, args=[factory]) if scope.called_name(
            function
        ) == "collections.defaultdict" and isinstance(expected, Collection):
            if isinstance(factory, ast.Lambda):
                made = scope.type_of(factory.body)
            else:
                made = called(scope.called_name(factory), (), {})
            wrong = argument_problem(None, made, expected.element, scope.type_of)
            return f"a new value: {wrong}" if wrong is not None else None
        case _:
            return None


def _is_record(target: ast.Subscript, scope: FunctionTypes) -> bool:
    """Return whether a dict, written with its keys, gets a further item of its own type."""
    if not isinstance(target.slice, ast.Constant) or not isinstance(target.value, ast.Name):
        return False
    bindings = scope.bindings.names.get(target.value.id, [])
    return not bindings or any(isinstance(binding.expression, ast.Dict) for binding in bindings)


def _stored(
    node: ast.expr, expected: Value, what: str, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    wrong = argument_problem(node, scope.type_of(node), expected, scope.type_of)
    if wrong is None and is_number(expected) and uses_numpy(scope.home):
        from composer.behavior_checks.operations.array_shapes import (  # noqa: PLC0415 (start-up time)
            is_array,
        )

        wrong = "an array where a number is expected" if is_array(node, scope) else None
    if wrong is not None:
        yield CodeProblem(Kind.VALUE, f"{what}: {wrong}", span_of(node, scope.home.source))


def _text(call: ast.Call, name: str, scope: FunctionTypes) -> Iterator[CodeProblem]:
    """Yield the arguments of a method of texts that are not texts."""
    for argument in call.args[: _OF_TEXTS[name]]:
        found = scope.type_of(argument)
        kind = kind_of(found)
        is_choice = name in {"endswith", "startswith"} and kind == "collection"
        if kind not in (None, "text", "tuple") and not is_choice:
            problem = f"'{name}' takes a string, not {shown(found)}"
            yield CodeProblem(Kind.VALUE, problem, span_of(argument, scope.home.source))
            return


def _joined(node: ast.expr, scope: FunctionTypes) -> Iterator[CodeProblem]:
    found = scope.type_of(node)
    is_iterable = isinstance(found, Collection) or (
        isinstance(found, FieldType) and (found.is_array or is_text(found))
    )
    if not is_iterable and kind_of(found) is not None:
        problem = f"'join' takes strings, not {shown(found)}"
        yield CodeProblem(Kind.VALUE, problem, span_of(node, scope.home.source))
        return
    items = scope.element(found) if is_iterable else found
    wrong = argument_problem(None, items, STRING, scope.type_of)
    if wrong is not None:
        problem = f"'join' takes strings: {wrong}"
        yield CodeProblem(Kind.VALUE, problem, span_of(node, scope.home.source))
