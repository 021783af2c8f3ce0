"""Constants and lists that do not fit the fields of messages, and the messages that code names.

Only plain syntax counts: constructors of messages, arguments of handlers and callbacks,
annotations, names that are assigned once, and paths through fields. Other expressions have no known
type, because a type checker runs as well.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

from composer.base.fast_dataclass import dataclass
from composer.interfaces import Field, FieldType, Interfaces, Message, parts
from composer.interfaces.field_types.types import (
    ANYTHING,
    ValueType,
    constant_problem,
    enumerator_problem,
    fields_of,
)
from composer.interfaces.sources import FOLDERS
from composer.model import Node
from composer.python_code.checker.copies import callback_signatures
from composer.python_code.lookup import BehaviorSource
from composer.python_code.problems import Family, Problem
from composer.python_code.scopes import Scope
from composer.python_code.trees import Function, bindings, dotted, positional_arguments, span_of

_EQUALITY = (ast.Eq, ast.NotEq, ast.In, ast.NotIn)
#: Maximum number of names and fields to follow.
_MAXIMUM_STEPS = 16


def message_problems(scope: NodeScope) -> Iterator[Problem]:
    """Yield what is assigned to the fields of messages, or compared with them, and does not fit."""
    for node in scope.nodes:
        match node:
            case ast.Assign(targets=targets, value=value):
                for target in targets:
                    if isinstance(target, ast.Attribute):
                        yield from _field_problems(scope.field(target), value, scope)
                    elif isinstance(target, ast.Subscript):
                        yield from _value_problems(value, scope.type(target), scope)
            case ast.Call(func=function, keywords=[_, *_] as keywords):
                message = scope.message_class(function)
                if message is not None:
                    yield from _keyword_problems(message, keywords, scope)
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                found = scope.field(left) if isinstance(operator, _EQUALITY) else None
                for other in getattr(right, "elts", [right]):
                    yield from _enumerator_problem(found, other, scope)


def _keyword_problems(
    message: Message, keywords: list[ast.keyword], scope: NodeScope
) -> Iterator[Problem]:
    for keyword in keywords:
        field = message.field(keyword.arg or "")
        if field is not None:
            yield from _field_problems((message, field), keyword.value, scope)


def _field_problems(
    found: tuple[Message, Field] | None, node: ast.expr, scope: NodeScope
) -> Iterator[Problem]:
    if found is None:
        return
    problems = list(_value_problems(node, found[1].type, scope))
    yield from problems or _enumerator_problem(found, node, scope)
    if found[1].name.endswith("frame_id"):
        yield from _frame_problem(node, scope)


def _frame_problem(node: ast.expr, scope: NodeScope) -> Iterator[Problem]:
    """Yield a frame ID with a slash: a constant, or the value of a parameter where it is set."""
    value, span = scope.constant(node), span_of(node, scope.source)
    name = dotted(node)
    for parameter in scope.code.node.parameters if name.startswith("self.parameters.") else ():
        if name == f"self.parameters.{parameter.name.value}" and parameter.value is not None:
            value, span = str(parameter.value.value), parameter.value.span
    if isinstance(value, str) and value.startswith("/"):
        message = f"frame ID '{value}' begins with a slash"
        yield Problem(Family.FRAME, message, span, "remove the slash")


def _value_problems(node: ast.expr, type_: object, scope: NodeScope) -> Iterator[Problem]:
    """Yield why an expression does not fit a field or an element of ``type_``."""
    if not isinstance(type_, FieldType):
        return
    if isinstance(node, ast.IfExp):
        for part in (node.body, node.orelse):
            yield from _value_problems(part, type_, scope)
    elif type_.is_array:
        yield from _array_problems(node, type_, scope)
    else:
        value = scope.constant(node)
        # In Python, values of type byte are bytes, and those of type bool are integers.
        is_number = type_.is_primitive and type_.name not in ("bool", "byte")
        if value is None or isinstance(value, bool | bytes) or not is_number:
            return
        found = constant_problem(value, type_, scope.code.interfaces)
        if found is not None:
            yield Problem(Family.VALUE, found[0], span_of(node, scope.source), found[1])


def _array_problems(node: ast.expr, type_: FieldType, scope: NodeScope) -> Iterator[Problem]:
    count = _length(node, scope)
    size, bound = type_.array_size, type_.array_bound
    if count is not None and (
        (size is not None and count != size) or (bound is not None and count > bound)
    ):
        elements = f"{count} element" + ("" if count == 1 else "s")
        message = f"{elements} where {type_} is expected"
        yield Problem(Family.VALUE, message, span_of(node, scope.source))
        return
    items = [node.elt] if isinstance(node, ast.ListComp) else getattr(node, "elts", ())
    for item in items if isinstance(node, ast.List | ast.Tuple | ast.ListComp) else ():
        problem = next(_value_problems(item, type_.element, scope), None)
        if problem is not None:
            yield problem
            return  # the others have the same cause


def _length(node: ast.expr, scope: NodeScope) -> int | None:
    """Return the number of elements of a list, None if only running the code shows it."""
    match node:
        case ast.List(elts=items) | ast.Tuple(elts=items):
            is_open = any(isinstance(item, ast.Starred) for item in items)
            return None if is_open else len(items)
        case ast.BinOp(left=ast.List() as repeated, op=ast.Mult(), right=factor):
            length, times = _length(repeated, scope), scope.constant(factor)
            return length * times if length is not None and isinstance(times, int) else None
    return None


def _enumerator_problem(
    found: tuple[Message, Field] | None, node: ast.expr, scope: NodeScope
) -> Iterator[Problem]:
    """Yield why a value is none of the constants for a field; the code does not fail."""
    if found is None or found[1].type.is_array:
        return
    problem = enumerator_problem(found[0], found[1].name, scope.constant(node))
    if problem is not None:
        span = span_of(node, scope.source)
        yield Problem(Family.VALUE, problem[0], span, problem[1], is_certain=False)


@dataclass(eq=False)
class Code:
    """The functions in the project's files for one node."""

    node: Node
    source: BehaviorSource
    interfaces: Interfaces

    @cached_property
    def scopes(self) -> Sequence[NodeScope]:
        """All files and functions."""
        own: dict[ast.AST | None, tuple[ast.ClassDef, Mapping[str, str]]] = {}
        for module, class_ in self.source.own_classes:
            known = callback_signatures(class_.node, module, self.node, self.interfaces)
            for method in class_.methods:
                signature = known.get(method.name)
                types = [type_ for _, type_ in signature.arguments] if signature else []
                passed = dict(zip(method.arguments, types, strict=False))
                own[method.node] = class_.node, passed
        scopes = [
            NodeScope(module.source, module.tree, module.names, code=self)
            for module in self.source.own_modules
        ]
        functions = ((home, x) for home in scopes for x in home.nodes if isinstance(x, Function))
        for home, node in tuple(functions):
            place, arguments = own.get(node, (None, {}))
            scopes.append(replace(home, function=node, class_=place, passed=arguments))
        return tuple(scopes)

    @cached_property
    def assigned(self) -> frozenset[str]:
        """The attributes of ``self`` that methods assign."""
        names = (name for _, class_ in self.source.own_classes for name in bindings(class_.node))
        return frozenset(name.removeprefix("self.") for name in names if name.startswith("self."))


@dataclass(eq=False)
class NodeScope(Scope):
    """A function in the files of a node, or the statements of a file outside of functions.

    ``passed`` are the arguments that the composer or rclpy passes, with their types.
    """

    code: Code = field(kw_only=True, repr=False)
    passed: Mapping[str, str] = field(default_factory=dict)

    def constant(self, node: ast.expr | None) -> str | int | float | None:
        """Return the value of a number or text, None if it is not known."""
        value = self.known(self.literal, node)
        return value if isinstance(value, str | int | float) else None

    def message_class(self, node: ast.expr | str) -> Message | None:
        """Return the message whose class an expression is."""
        names = self.full_name(node).split(".")
        if len(names) not in (3, 4) or names[1] not in FOLDERS:
            return None
        definition = self.code.interfaces.find("/".join(names[:3]))
        part = names[3].lower() if len(names) == 4 else "message"
        return parts(definition).get(part) if definition is not None else None

    def field(self, node: ast.expr, steps: int = 0) -> tuple[Message, Field] | None:
        """Return the field that an attribute is, with its message."""
        if not isinstance(node, ast.Attribute):
            return None
        message = fields_of(self.type(node.value, steps + 1), self.code.interfaces)
        found = message.field(node.attr) if message is not None else None
        return (message, found) if message is not None and found is not None else None

    def type(self, node: ast.expr, steps: int = 0) -> ValueType:
        """Return the type of an expression, ANYTHING if it is not known."""
        match node if steps <= _MAXIMUM_STEPS else None:
            case ast.Name(id=name):
                values = [value for value in self.bound(name) if value is not None]
                if len(values) == 1:
                    return self.type(values[0], steps + 1)
                return ANYTHING if values else self._argument(name)
            case ast.Attribute():
                found = self.field(node, steps)
                return found[1].type if found is not None else ANYTHING
            case ast.Subscript(value=owner, slice=index) if not isinstance(index, ast.Slice):
                array = self.type(owner, steps + 1)
                if isinstance(array, FieldType) and array.is_array:
                    return array.element
            case ast.Call(func=function):
                return self.message_class(function) or ANYTHING
        return ANYTHING

    def _argument(self, name: str) -> ValueType:
        if self.function is None:
            return ANYTHING
        given = positional_arguments(self.function)
        annotation = next((item.annotation for item in given if item.arg == name), None)
        return self.message_class(annotation or self.passed.get(name, "")) or ANYTHING
