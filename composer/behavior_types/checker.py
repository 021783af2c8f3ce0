"""Checks the methods of a behavior against its node and the definitions of messages."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from composer.behavior_source import BehaviorSource, Function, Module
from composer.behavior_source.flow import (
    empty_returns,
    is_stub,
    may_raise_at_end,
    reaches_end,
    returned_values,
)
from composer.behavior_source.receivers import lacks_self
from composer.behavior_source.spans import attribute_span, span_of, start_span
from composer.behavior_source.syntax import name_span
from composer.behavior_types.annotations import allows_none, annotated
from composer.behavior_types.api_values import api_parameters
from composer.behavior_types.arguments import api_signature, constructor, signature_of
from composer.behavior_types.attributes import attribute_problem
from composer.behavior_types.bindings import assigned_pairs, nodes_of
from composer.behavior_types.elements import element_problems, size_problem
from composer.behavior_types.expressions import FunctionTypes
from composer.behavior_types.fitting import argument_problem, value_problem
from composer.behavior_types.frames import frame_problem
from composer.behavior_types.handlers import handler_arguments
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.operations import (
    annotations_by_name,
    annotations_of,
    call_problems,
    operation_problems,
    returned_exceptions,
    uncallable,
)
from composer.behavior_types.problems import CodeProblem, Kind
from composer.behavior_types.self_attributes import misspelled_attributes
from composer.behavior_types.stored_calls import used_without_await
from composer.behavior_types.values import (
    ApiMethod,
    ApiValue,
    Collection,
    CollectionMethod,
    InterfaceClass,
    ModuleFunction,
    OwnClass,
    OwnMethod,
    Parameters,
    Pending,
    Ports,
    Self,
    Value,
)
from composer.diagnostics import suggestion
from composer.fast_dataclass import dataclass
from composer.field_types import described
from composer.interfaces import Action, Field, FieldType, Interfaces, Message, Service
from composer.model import Node
from composer.source import Span

#: Attributes of awaitables that code may use instead of awaiting them.
_OF_AWAITABLES = frozenset({"add_done_callback", "cancel", "close", "done", "exception", "send"})


def behavior_problems(
    node: Node, source: BehaviorSource, interfaces: Interfaces
) -> Iterator[CodeProblem]:
    """Yield the problems in the behavior of a node, in methods of its own project.

    A missing attribute is reported once, where it is first used.
    """
    types = BehaviorTypes(node, source, interfaces)
    missing: set[str] = set()
    for checker in _checkers(types, source):
        try:
            problems = list(checker.problems())
        except RecursionError:  # too deeply nested to be checked
            continue
        for problem in problems:
            if problem.kind is not Kind.ATTRIBUTE or problem.message not in missing:
                yield problem
            if problem.kind is Kind.ATTRIBUTE:
                missing.add(problem.message)
    yield from misspelled_attributes(source)


def _checkers(types: BehaviorTypes, source: BehaviorSource) -> Iterator[_FunctionChecker]:
    own = {id(known) for _, known in source.own_classes}
    arguments = handler_arguments(types.node, types.interfaces)
    for home, known in source.own_classes:
        for method in known.methods:
            scope = types.scope(method, home)
            given = arguments.get(method.name)
            if scope is None or method.node is None:
                continue
            if not lacks_self(method.node, len(given) if given is not None else None):
                yield _FunctionChecker(types, scope, method.node, given or ())
    for home in source.own_modules:
        for item in home.tree.body:
            if isinstance(item, Function):
                yield _FunctionChecker(types, types.function(item, home, is_method=False), item)
        for known in home.classes.values():
            for method in known.methods if id(known) not in own else ():
                if method.node is not None:
                    scope = types.function(method.node, home, is_method=True)
                    yield _FunctionChecker(types, scope, method.node)


@dataclass(frozen=True, slots=True)
class _FunctionChecker:
    types: BehaviorTypes
    scope: FunctionTypes
    function: Function
    given: tuple[Value, ...] = ()  # what a handler gets, without self

    def problems(self) -> Iterator[CodeProblem]:
        """Yield the problems of the function."""
        wrong = next(self._annotations(), None)
        if wrong is not None:
            yield wrong
        else:
            yield from self._returned()
        yield from returned_exceptions(self.function, self.scope)
        for annotation in annotations_of(self.function):
            for node in ast.walk(annotation):
                if isinstance(node, ast.Attribute):
                    yield from self._attribute(node)
        for pending in used_without_await(self.function, self.scope):
            yield self._missing_await(pending)
        for node in nodes_of(self.function):
            match node:
                case ast.Attribute():
                    yield from self._attribute(node)
                case ast.Subscript(value=owner, slice=ast.Constant(value=str() as name)):
                    yield from self._key(owner, name, node)
                case ast.Call():
                    yield from self._call(node)
                case ast.Assign(targets=[target], value=value):
                    for part, given in assigned_pairs(target, value):
                        yield from self._assignment(part, given)
            yield from self._unawaited(node)
            yield from operation_problems(node, self.scope)
            yield from element_problems(node, self.function, self.scope)

    # --- attributes

    def _attribute(self, node: ast.Attribute) -> Iterator[CodeProblem]:
        owner = self.scope.type_of(node.value)
        if isinstance(owner, Pending):
            if node.attr not in _OF_AWAITABLES:
                yield self._missing_await(owner)
            return
        found = attribute_problem(self.types, owner, node.attr)
        if found is not None:
            kind, message, hint = found
            span = attribute_span(node, self.scope.home.source)
            if kind is Kind.VALUE:  # the value is wrong where it was stored
                span = self._span(self._origin(node.value))
            yield CodeProblem(kind, message, span, hint)

    def _origin(self, node: ast.expr) -> ast.expr:
        """Return the expression that a name was assigned, if there is exactly one."""
        name = node.id if isinstance(node, ast.Name) else ""
        bindings = self.scope.bindings.names.get(name, [])
        only = bindings[0].expression if len(bindings) == 1 else None
        return only if only is not None else node

    def _key(self, owner: ast.expr, name: str, node: ast.Subscript) -> Iterator[CodeProblem]:
        type_ = self.scope.type_of(owner)
        if isinstance(type_, Ports | Parameters):
            found = attribute_problem(self.types, type_, name)
            if found is not None:
                yield CodeProblem(found[0], found[1], self._span(node.slice), found[2])

    # --- calls

    def _call(self, node: ast.Call) -> Iterator[CodeProblem]:
        match self.scope.type_of(node.func):
            case InterfaceClass(definition=Message() as message):
                yield from self._constructor(node, message)
            case InterfaceClass(definition=Service() | Action() as definition):
                parts = "Request" if isinstance(definition, Service) else "Goal"
                name = definition.name.rpartition("/")[2]
                problem = f"{definition.name} cannot be created"
                hint = f"create {name}.{parts}()"
                yield CodeProblem(Kind.VALUE, problem, self._span(node.func), hint)
            case ApiMethod(owner=owner, member=member):
                signature = api_signature(owner.class_name, member.name)
                types = api_parameters(owner.class_name, member.name)
                found = list(call_problems(node, signature, self.scope, types))
                yield from found
                expected = self._expected(owner, member.name)
                if expected is not None and node.args and not found:
                    yield from self._value(node.args[0], expected)
            case OwnMethod(method=method, home=home) if method.node is not None:
                if not lacks_self(method.node):
                    yield from self._own_call(node, method.node, home, is_bound=True)
            case ModuleFunction(node=function, home=home, is_bound=is_bound):
                yield from self._own_call(node, function, home, is_bound=is_bound)
            case OwnClass() as own:
                parameters = constructor(own)
                if parameters is not None:
                    yield from call_problems(node, parameters, self.scope)
            case CollectionMethod() | Collection():
                pass
            case other:
                yield from self._element_added(node)
                reason = uncallable(other)
                if reason is not None:
                    yield CodeProblem(Kind.VALUE, reason[0], self._span(node.func), reason[1])

    def _own_call(
        self, node: ast.Call, function: Function, home: Module, *, is_bound: bool
    ) -> Iterator[CodeProblem]:
        signature = signature_of(function, is_bound=is_bound)
        if signature is not None:
            expected = annotations_by_name(function, home, self.types)
            yield from call_problems(node, signature, self.scope, expected)

    def _element_added(self, node: ast.Call) -> Iterator[CodeProblem]:
        """Check what ``append`` and ``insert`` add to a list in a message."""
        if isinstance(node.func, ast.Attribute) and node.func.attr in {"append", "insert"}:
            array = self.scope.type_of(node.func.value)
            if isinstance(array, FieldType) and array.is_array and node.args:
                yield from self._value(node.args[-1], array.element)

    def _constructor(self, node: ast.Call, message: Message) -> Iterator[CodeProblem]:
        for argument in node.args:
            if not isinstance(argument, ast.Starred):
                problem = f"{message.name} takes keyword arguments only"
                fields = ", ".join(f"{name}=..." for name in message.field_names[:3])
                hint = f"fields: {fields}" if fields else None
                yield CodeProblem(Kind.VALUE, problem, self._span(argument), hint)
                return
        for keyword in node.keywords:
            if keyword.arg is None:
                continue
            field = message.field(keyword.arg)
            if field is not None:
                yield from self._field(keyword.value, field)
            elif keyword.arg != "check_fields":
                problem = f"{message.name} has no field '{keyword.arg}'"
                hint = suggestion(keyword.arg, message.field_names)
                span = start_span(keyword, len(keyword.arg), self.scope.home.source)
                yield CodeProblem(Kind.FIELD, problem, span, hint)

    def _expected(self, owner: ApiValue, name: str) -> Message | None:
        """Return the message that the first argument of a method of the API must be."""
        port = owner.port
        definition = self.types.interfaces.find(port.interface.value) if port else None
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

    # --- values

    def _assignment(self, target: ast.expr, value: ast.expr) -> Iterator[CodeProblem]:
        if not isinstance(target, ast.Attribute):
            if isinstance(target, ast.Tuple) and isinstance(self.scope.type_of(value), Pending):
                yield from self._pending(value)
            return
        owner = self.scope.type_of(target.value)
        if isinstance(owner, Self):
            expected = self.types.annotation(target.attr)
            wrong = argument_problem(value, self.scope.type_of(value), expected)
            if wrong is not None:
                problem = f"attribute '{target.attr}': {wrong}"
                yield CodeProblem(Kind.VALUE, problem, self._span(value))
            return
        message = owner if isinstance(owner, Message) else None
        field = message.field(target.attr) if message is not None else None
        if field is not None:
            yield from self._field(value, field)

    def _returned(self) -> Iterator[CodeProblem]:
        """Check what a function returns; None has a rule of its own in handlers of services."""
        match self.given:
            case (_, Message() as response):
                for value in returned_values(self.function):
                    yield from self._value(value, response)
                return
        annotation = self.function.returns
        if annotation is None:
            return
        expected = annotated(annotation, self.scope.home, self.types.node, self.types.interfaces)
        name = self.function.name
        if allows_none(annotation) or name.startswith("accept_") or is_stub(self.function):
            return
        if not isinstance(expected, Message | FieldType):
            return
        returns = f"'{name}' returns {described(expected)}"
        for statement in empty_returns(self.function):
            span = span_of(statement, self.scope.home.source)
            yield CodeProblem(Kind.RETURN, f"{returns}, not None", span, "return a value")
        if reaches_end(self.function) and not may_raise_at_end(self.function):
            problem = f"{returns}, but may end without a 'return'"
            yield CodeProblem(Kind.RETURN, problem, self._name_span(), "return a value at its end")

    def _field(self, node: ast.expr, field: Field) -> Iterator[CodeProblem]:
        frame = frame_problem(node, field.name, self.scope)
        if frame is not None:
            yield frame
        else:
            yield from self._value(node, field.type)

    def _value(self, node: ast.expr, expected: Value) -> Iterator[CodeProblem]:
        found = self.scope.type_of(node)
        if isinstance(found, Pending):
            yield self._missing_await(found)
            return
        if isinstance(node, ast.List | ast.Tuple) and isinstance(expected, FieldType):
            for item in node.elts if expected.is_array and expected.name != "byte" else ():
                yield from self._value(item, expected.element)
        problem = value_problem(node, found, expected, self.types.interfaces)
        if problem is None and isinstance(expected, FieldType):
            size = size_problem(node, expected)
            problem = (size, None) if size is not None else None
        if problem is not None:
            yield CodeProblem(Kind.VALUE, problem[0], self._span(node), problem[1])

    # --- awaitables

    def _unawaited(self, node: ast.AST) -> Iterator[CodeProblem]:
        match node:
            case ast.Expr(value=value):
                yield from self._pending(value)
            case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
                yield from self._pending_call(test)
            case ast.UnaryOp(operand=operand):
                yield from self._pending_call(operand)
            case ast.BoolOp(values=values):
                for value in values:
                    yield from self._pending_call(value)
            case ast.BinOp(left=left, right=right):
                yield from self._pending(left)
                yield from self._pending(right)
            case ast.Compare(left=left, comparators=others):
                for value in (left, *others):
                    yield from self._pending_call(value)
            case ast.Subscript(value=value) | ast.FormattedValue(value=value):
                yield from self._pending(value)
            case ast.For(iter=iterated):
                yield from self._pending(iterated)
            case ast.Return(value=ast.Call() as value):
                if isinstance(self.function, ast.AsyncFunctionDef):
                    yield from self._pending(value)
            case _:
                pass

    def _pending(self, node: ast.expr) -> Iterator[CodeProblem]:
        found = self.scope.type_of(node)
        if isinstance(found, Pending):
            yield self._missing_await(found)

    def _pending_call(self, node: ast.expr) -> Iterator[CodeProblem]:
        """Check a call; a name in this place may well be an awaitable that was stored."""
        if isinstance(node, ast.Call):
            yield from self._pending(node)

    def _missing_await(self, pending: Pending) -> CodeProblem:
        is_async = isinstance(self.function, ast.AsyncFunctionDef)
        hint = "write 'await' before it"
        if not is_async:
            hint += f", and 'async def {self.function.name}'"
        message = f"'{pending.name}' is asynchronous and is not awaited"
        return CodeProblem(Kind.AWAIT, message, self._span(pending.call.func), hint)

    # --- annotations

    def _annotations(self) -> Iterator[CodeProblem]:
        arguments = self.function.args
        positional = (*arguments.posonlyargs, *arguments.args)[1:]
        for argument, type_ in zip(positional, self.given, strict=False):
            if argument.annotation is None or not isinstance(type_, Message):
                continue
            found = self.scope.name(argument.arg)
            if isinstance(found, Message) and found != type_:
                yield CodeProblem(
                    Kind.ANNOTATION,
                    f"'{self.function.name}' gets a {type_.name}, not a {found.name}",
                    self._span(argument.annotation),
                )

    def _name_span(self) -> Span:
        return name_span(self.function, "def", self.scope.home.source)

    def _span(self, node: ast.expr) -> Span:
        return span_of(node, self.scope.home.source)
