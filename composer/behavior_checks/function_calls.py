"""Checks calls: of functions, methods and classes, of messages, and of the API."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from composer.behavior_checks.calls.arguments import (
    Signature,
    api_signature,
    constructor,
    fields_signature,
    method_signature,
    signature_of,
)
from composer.behavior_checks.calls.call import call_problems, uncallable
from composer.behavior_checks.calls.collection_calls import method_problems
from composer.behavior_checks.calls.pattern_groups import group_problems
from composer.behavior_checks.calls.rclpy_calls import rclpy_call
from composer.behavior_checks.calls.standard_calls import shape_problems
from composer.behavior_checks.calls.swapped_arguments import swapped_arguments
from composer.behavior_checks.fitting import kind_of, shown
from composer.behavior_checks.messages.message_values import ValueChecker
from composer.behavior_checks.operations.membership import enumeration_problems
from composer.behavior_checks.operations.operations import annotations_by_name
from composer.behavior_checks.parts import uses_numpy
from composer.behavior_checks.problems import CodeProblem, Kind
from composer.behavior_source import Function, Module
from composer.behavior_source.receivers import lacks_self
from composer.behavior_source.spans import span_of, start_span
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import fields_expected
from composer.behavior_types.expressions.protocols import special_method
from composer.behavior_types.expressions.results import changed_tuple
from composer.behavior_types.hosted import rclpy_function
from composer.behavior_types.libraries.api_values import api_parameters
from composer.behavior_types.libraries.numpy_names import ndarray
from composer.behavior_types.syntax.lineage import lineage
from composer.behavior_types.syntax.own_classes import (
    abstract_methods,
    constructor_of,
    fields_of_class,
    is_record,
)
from composer.behavior_types.values import (
    AnyFunction,
    ApiMethod,
    ApiValue,
    BuiltinMethod,
    CollectionMethod,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    Value,
)
from composer.diagnostics import nearest, suggestion
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING
from composer.interfaces import Action, Message, Service
from composer.source import Span

#: Attributes of arrays that are often taken for methods.
_DATA = frozenset({"T", "dtype", "ndim", "shape", "size"})


@dataclass(frozen=True, slots=True)
class CallChecker:
    """Checks the calls in one function."""

    scope: FunctionTypes
    values: ValueChecker

    def problems(self, node: ast.Call) -> Iterator[CodeProblem]:
        """Yield why a call fails."""
        called = rclpy_function(node, self.scope)
        if called is not None:
            yield from rclpy_call(node, called, self.scope, self.values.value)
            return
        match self.scope.type_of(node.func):
            case InterfaceClass(definition=Message() as message):
                yield from self.values.created(node, message)
            case InterfaceClass(definition=Service() | Action() as definition):
                parts = "Request" if isinstance(definition, Service) else "Goal"
                name = definition.name.rpartition("/")[2]
                problem = f"{definition.name} cannot be created"
                hint = f"create {name}.{parts}()"
                yield CodeProblem(Kind.VALUE, problem, self._span(node.func), hint)
            case ApiMethod(owner=owner, member=member):
                signature = api_signature(owner.class_name, member.name)
                types = api_parameters(owner.class_name, member.name, self.scope.owner.interfaces)
                found = list(call_problems(node, signature, self.scope, types))
                yield from found
                expected = self._expected(owner, member.name)
                if expected is not None and node.args and not found:
                    yield from self.values.value(node.args[0], expected)
            case OwnMethod(method=method, home=home) if method.node is not None:
                if not lacks_self(method.node):
                    yield from self._own_call(node, method.node, home, is_bound=True)
            case ModuleFunction(node=function, home=home, is_bound=is_bound):
                yield from self._own_call(node, function, home, is_bound=is_bound)
            case OwnClass() as own if not self._may_be_derived(node.func, own):
                yield from self._created(node, own)
            case AnyFunction(arguments=tuple() as takes):
                yield from self._described(node, takes)
            case BuiltinMethod(python=python, name=name):
                yield from self._builtin(node, python, name)
            case CollectionMethod(owner=collection, name=name):
                yield from method_problems(node, collection, name, self.scope)
            case _ if (changed := changed_tuple(self.scope, node)) is not None:
                parameters = fields_signature(changed.of, "_replace", first=False)
                if parameters is not None:
                    fields = fields_expected(self.scope, changed.of)
                    yield from call_problems(node, parameters, self.scope, fields)
            case other:
                yield from self._of_array(node)
                yield from self.values.added(node)
                special = special_method(self.scope, other, "__call__")
                if special is not None:
                    yield from self._own_call(node, special.node, special.home, is_bound=True)
                reason = uncallable(other)
                if reason is not None:
                    yield CodeProblem(Kind.VALUE, reason[0], self._span(node.func), reason[1])

    def _builtin(self, node: ast.Call, python: type, name: str) -> Iterator[CodeProblem]:
        """Check a call of a method of an array of numpy, or of a source of random numbers."""
        if python is re.Pattern and node.args and name in {"fullmatch", "match", "search"}:
            found = self.scope.type_of(node.args[0])
            if kind_of(found) not in (None, "bytes", "text"):
                problem = f"'{name}' takes a string, not {shown(found)}"
                yield CodeProblem(Kind.VALUE, problem, self._span(node.args[0]))
        if python is re.Match:
            yield from group_problems(node, name, self.scope)
        is_known = python is ndarray or python.__module__ == "random"
        parameters = method_signature(python, name) if is_known else None
        if parameters is not None:
            yield from call_problems(node, parameters, self.scope)
        yield from self._of_array(node)

    def _of_array(self, node: ast.Call) -> Iterator[CodeProblem]:
        """Check a call of a method of an array of numpy, or of the array itself."""
        if not uses_numpy(self.scope.home):
            return
        if isinstance(node.func, ast.Attribute):
            if node.func.attr in _DATA and self._is_array(node.func.value):
                problem = f"'{node.func.attr}' of an array is not a function"
                yield CodeProblem(Kind.VALUE, problem, self._span(node.func), "remove '()'")
            elif not self.scope.called_name(node.func):
                yield from shape_problems(node, f".{node.func.attr}", self.scope)
        elif isinstance(node.func, ast.Name) and self._is_array(node.func):
            problem, hint = "an array of numpy is not a function", "write [...] for an index"
            yield CodeProblem(Kind.VALUE, problem, self._span(node.func), hint)

    def _is_array(self, node: ast.expr) -> bool:
        """Return whether only the shape of an expression shows that it is an array."""
        from composer.behavior_checks.operations.array_shapes import (  # noqa: PLC0415 (start-up time)
            rank_of,
        )

        return self.scope.type_of(node) is ANYTHING and bool(rank_of(node, self.scope))

    def _created(self, node: ast.Call, own: OwnClass) -> Iterator[CodeProblem]:
        yield from enumeration_problems(node, own, self.scope)
        parameters = constructor(own)
        missing = abstract_methods(own)
        if is_record(own):
            yield from self._record(node, own)
        elif missing:
            yield self._abstract(node, own, missing)
        elif parameters is not None:
            fields = self._of_constructor(own)
            yield from call_problems(node, parameters, self.scope, fields)

    def _record(self, node: ast.Call, own: OwnClass) -> Iterator[CodeProblem]:
        """Check the keys that a TypedDict is created with."""
        fields = [item.name for known in lineage(own).classes for item in fields_of_class(known)]
        for keyword in node.keywords:
            if keyword.arg is not None and keyword.arg not in fields:
                message = f"'{own.definition.name}' has no key '{keyword.arg}'"
                span = start_span(keyword, len(keyword.arg), self.scope.home.source)
                yield CodeProblem(Kind.CALL, message, span, suggestion(keyword.arg, fields))
                return

    def _abstract(self, node: ast.Call, own: OwnClass, missing: list[str]) -> CodeProblem:
        name = own.definition.name
        close = nearest(missing[0], [method.name for method in own.definition.methods])
        hint = f"rename '{close}' to '{missing[0]}'" if close else None
        listed = " and ".join(f"'{item}'" for item in missing)
        message = f"'{name}' cannot be created: it does not implement {listed}"
        return CodeProblem(Kind.CALL, message, self._span(node.func), hint)

    def _described(self, node: ast.Call, takes: tuple[Value, ...]) -> Iterator[CodeProblem]:
        """Check a call of a function that only its annotation describes."""
        names = tuple(f"argument {at + 1}" for at in range(len(takes)))
        signature = Signature(ast.unparse(node.func), names, (), frozenset(names), len(takes))
        types = dict(zip(names, takes, strict=True))
        yield from call_problems(node, signature, self.scope, types)

    def _own_call(
        self, node: ast.Call, function: Function, home: Module, *, is_bound: bool
    ) -> Iterator[CodeProblem]:
        signature = signature_of(function, is_bound=is_bound)
        if signature is not None:
            expected = annotations_by_name(function, home, self.scope.owner)
            found = list(call_problems(node, signature, self.scope, expected))
            for problem in found:
                yield replace(problem, called=(function, home))
            if not found and len(node.args) > 1:
                yield from swapped_arguments(node, signature, function, self.scope)

    def _may_be_derived(self, called: ast.expr, own: OwnClass) -> bool:
        """Return whether a class method creates what may be of another class: by 'cls(...)'."""
        is_argument = isinstance(called, ast.Name) and self.scope.is_local(called.id)
        is_known = constructor_of(own) is not None
        derived = self.scope.owner.project_classes.derived(own)
        return is_argument and not (is_known and not derived)

    def _of_constructor(self, own: OwnClass) -> Mapping[str, Value]:
        """Return the types of the parameters of a constructor, by name."""
        match constructor_of(own):
            case (function, defining):
                return annotations_by_name(function, defining.home, self.scope.owner)
            case _:
                return fields_expected(self.scope, own)

    def _expected(self, owner: ApiValue, name: str) -> Message | None:
        """Return the message that the first argument of a method of the API must be."""
        port = owner.port
        definition = self.scope.owner.interfaces.find(port.interface.value) if port else None
        match name, definition:
            case "publish", Message() as message:
                return message
            case "call", Service() as service:
                return service.request
            case "send_goal", Action() as action:
                return action.goal
            case "publish_feedback", Action() as action:
                return action.feedback
            case _:
                return None

    def _span(self, node: ast.expr) -> Span:
        return span_of(node, self.scope.home.source)
