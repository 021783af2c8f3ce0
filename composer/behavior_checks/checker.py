"""Checks the methods of a behavior against its node and the definitions of messages."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import TYPE_CHECKING

from composer.behavior_checks.annotated_values import argument_problem, problem_place
from composer.behavior_checks.attributes.changing_attributes import changing_attributes
from composer.behavior_checks.attributes.fixed_attributes import fixed_problems
from composer.behavior_checks.attributes.misspelled_attributes import misspelled_attributes
from composer.behavior_checks.attributes.unknown_attributes import (
    attribute_problem,
    names_looked_for,
)
from composer.behavior_checks.attributes.unset_attributes import late_attributes, unset_attributes
from composer.behavior_checks.calls.collection_calls import (
    default_problem,
    key_problems,
    stored_problems,
)
from composer.behavior_checks.calls.rclpy_calls import transition_problems
from composer.behavior_checks.calls.wrong_definitions import at_definitions
from composer.behavior_checks.classes import class_problems
from composer.behavior_checks.declared_keys import key_problems_of, member_key_problems_of
from composer.behavior_checks.fitting import value_problem
from composer.behavior_checks.function_calls import CallChecker
from composer.behavior_checks.messages.elements import element_problems
from composer.behavior_checks.messages.message_values import ValueChecker
from composer.behavior_checks.missing_values import missing_values
from composer.behavior_checks.node_classes import missing_constructors, undeclared_parameters
from composer.behavior_checks.operations.awaiting import (
    missing_await,
    pending_value,
    unawaited,
    used_without_await,
)
from composer.behavior_checks.operations.formats import text_problems
from composer.behavior_checks.operations.iteration import iteration_problems
from composer.behavior_checks.operations.membership import LOOKUPS, lookup_problems
from composer.behavior_checks.operations.operations import (
    annotations_of,
    operation_problems,
    returned_exceptions,
)
from composer.behavior_checks.operations.protocols import CHECKED, protocol_problems
from composer.behavior_checks.operations.returns import (
    must_return,
    return_problems,
    transition_results,
)
from composer.behavior_checks.operations.truth import TESTING, truth_problems
from composer.behavior_checks.parts import outside_functions, scalar_name
from composer.behavior_checks.problems import CodeProblem, Kind, distinct
from composer.behavior_checks.refused_parameters import refused_parameters
from composer.behavior_source import BehaviorSource, Function
from composer.behavior_source.flow import returned_values
from composer.behavior_source.method_body import dotted
from composer.behavior_source.receivers import lacks_self
from composer.behavior_source.spans import attribute_span, span_of
from composer.behavior_types.expressions.annotations import annotated
from composer.behavior_types.expressions.function_types import FunctionTypes
from composer.behavior_types.expressions.objects import annotation_of
from composer.behavior_types.hosted import HostedTypes
from composer.behavior_types.inference import BehaviorTypes
from composer.behavior_types.libraries.handlers import Handler
from composer.behavior_types.syntax.bindings import assigned_pairs, nodes_of
from composer.behavior_types.syntax.names import constant_named
from composer.behavior_types.values import (
    Collection,
    InterfaceClass,
    OwnClass,
    OwnObject,
    Parameters,
    Pending,
    Ports,
    Self,
)
from composer.fast_dataclass import dataclass
from composer.field_types import ANYTHING
from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Node
from composer.source import Span

if TYPE_CHECKING:
    from composer.behavior_checks.calls.blame import Blame

#: Nodes of which only what is around them is checked; most nodes are of these.
_UNCHECKED = (ast.Constant, ast.Name, ast.arg, ast.arguments, ast.keyword)
#: Attributes of awaitables that code may use instead of awaiting them.
_OF_AWAITABLES = frozenset(
    {"__await__", "add_done_callback", "cancel", "close", "done", "exception", "send", "throw"}
)


def behavior_problems(
    node: Node, source: BehaviorSource, interfaces: Interfaces
) -> Iterator[CodeProblem]:
    """Yield the problems in the behavior or the class of a node, in methods of its own project.

    A missing attribute is reported once, where it is first used.
    """
    is_hosted = node.hosted_class is not None
    types = (HostedTypes if is_hosted else BehaviorTypes)(node, source, interfaces)
    types.infer()
    yield from at_definitions(_all_problems(types, source), source)


def _all_problems(types: BehaviorTypes, source: BehaviorSource) -> Iterator[CodeProblem]:
    is_hosted = isinstance(types, HostedTypes)
    if isinstance(types, HostedTypes):
        yield from missing_constructors(types)
        yield from undeclared_parameters(types)
        yield from transition_problems(types)
    for names, problem in refused_parameters(types) if not is_hosted else ():
        types.refused |= names  # what else they cause is never reached
        yield problem
    missing: set[str] = set()
    wrong: dict[str, CodeProblem] = {}
    blame = _blame(types)
    for checker in _checkers(types, source):
        try:
            problems = list(checker.blamed(blame))
        except RecursionError:  # too deeply nested to be checked
            continue
        for problem in problems:
            attribute = problem.attribute
            if wrong.setdefault(attribute, problem) is not problem and attribute:
                continue  # it has one value of a wrong type
            if problem.kind is not Kind.ATTRIBUTE or problem.message not in missing:
                yield problem
            if problem.kind is Kind.ATTRIBUTE:
                missing.add(problem.message)
    if not is_hosted:  # rclpy calls some callbacks only after another one
        yield from unset_attributes(types)
    elif isinstance(types, HostedTypes):
        yield from late_attributes(types)
    yield from changing_attributes(types)
    yield from class_problems(types)
    yield from misspelled_attributes(source)


def _blame(types: BehaviorTypes) -> Blame | None:
    if not types.has_open_functions:
        return None
    from composer.behavior_checks.calls.blame import Blame  # noqa: PLC0415 (start-up time)

    return Blame(types.call_sites)


def _checkers(types: BehaviorTypes, source: BehaviorSource) -> Iterator[_FunctionChecker]:
    own = {id(known) for _, known in source.own_classes}
    for home in source.own_modules:  # it runs first
        yield _FunctionChecker(types, types.at_module(home), outside_functions(home))
    for home, known in source.own_classes:
        for method in known.methods:
            scope = types.scope(method, home)
            handler = types.handlers.get(method.name)
            if scope is None or method.node is None:
                continue
            if not lacks_self(method.node, len(handler.arguments) if handler else None):
                yield _FunctionChecker(types, scope, method.node, handler)
    for home in source.own_modules:
        for item in home.tree.body:
            if isinstance(item, Function):
                yield _FunctionChecker(types, types.function(item, home), item)
        for known in home.classes.values():
            for method in known.methods if id(known) not in own else ():
                if method.node is not None:
                    scope = types.function(method.node, home, OwnClass(known, home))
                    yield _FunctionChecker(types, scope, method.node)


def _index_problems(
    node: ast.Subscript, function: Function, scope: FunctionTypes
) -> Iterator[CodeProblem]:
    from composer.behavior_checks.operations.known_indices import (  # noqa: PLC0415 (start-up time)
        index_problems,
    )

    return index_problems(node, function, scope)


@dataclass(frozen=True, slots=True)
class _FunctionChecker:
    types: BehaviorTypes
    scope: FunctionTypes
    function: Function
    handler: Handler | None = None

    def blamed(self, blame: Blame | None) -> Iterator[CodeProblem]:
        """Yield the problems of the function, or of the calls that cause them."""
        if blame is None:
            return distinct(self.problems())
        types, function, handler = self.types, self.function, self.handler
        return blame.problems(
            function,
            self.scope,
            lambda scope: _FunctionChecker(types, scope, function, handler).problems(),
        )

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
        yield from missing_values(self.function, self.scope)
        for pending in used_without_await(self.function, self.scope):
            yield missing_await(pending, self.function, self.scope)
        calls = CallChecker(self.scope, self._values)
        for node in nodes_of(self.function):
            if isinstance(node, _UNCHECKED):
                continue
            match node:
                case ast.Attribute():
                    yield from self._attribute(node)
                    if not isinstance(node.ctx, ast.Load):
                        yield from fixed_problems(node, self.scope)
                    yield from lookup_problems(node, self.scope)
                    continue  # nothing else is checked of it
                case ast.Subscript():
                    yield from self._index(node)
                    yield from key_problems_of(node, self.function, self.scope)
                    yield from member_key_problems_of(node, self.function, self.scope)
                    if not isinstance(node.slice, ast.Constant | ast.Slice):
                        yield from _index_problems(node, self.function, self.scope)
                case ast.Call():
                    yield from calls.problems(node)
                case ast.Assign(targets=[target], value=value):
                    for part, given in assigned_pairs(target, value):
                        yield from self._assignment(part, given)
                case ast.AnnAssign(annotation=annotation, value=ast.expr() as value):
                    yield from self._annotated(annotation, value)
            yield from unawaited(node, self.function, self.scope)
            if isinstance(node, LOOKUPS):
                yield from lookup_problems(node, self.scope)
            if isinstance(node, CHECKED):
                yield from protocol_problems(node, self.scope)
            if isinstance(node, TESTING):
                yield from truth_problems(node, self.function, self.scope)
            yield from operation_problems(node, self.scope)
            yield from text_problems(node, self.scope)
            yield from element_problems(node, self.function, self.scope)
            yield from iteration_problems(node, self.scope)

    @property
    def _values(self) -> ValueChecker:
        return ValueChecker(self.scope, self.function)

    # --- attributes

    def _attribute(self, node: ast.Attribute) -> Iterator[CodeProblem]:
        owner = self.scope.type_of(node.value)
        if isinstance(owner, Pending):
            if node.attr not in _OF_AWAITABLES:
                yield missing_await(owner, self.function, self.scope)
            return
        found = attribute_problem(self.types, owner, node.attr)
        if found is not None and node.attr not in names_looked_for(self.function):
            kind, message, hint = found
            span = attribute_span(node, self.scope.home.source)
            if kind is Kind.VALUE:  # the value is wrong where it was stored
                span = self._span(self._origin(node.value))
            about = scalar_name(node.value, owner)
            if not (hint or "").startswith("did you mean"):
                about = about or dotted(node.value)  # its other attributes have the same cause
            yield CodeProblem(kind, message, span, hint, about=about)

    def _origin(self, node: ast.expr) -> ast.expr:
        """Return the expression that a name was assigned, if there is exactly one."""
        name = node.id if isinstance(node, ast.Name) else ""
        bindings = self.scope.bindings.names.get(name, [])
        only = bindings[0].expression if len(bindings) == 1 else None
        return only if only is not None else node

    def _index(self, node: ast.Subscript) -> Iterator[CodeProblem]:
        owner, index = self.scope.type_of(node.value), node.slice
        if isinstance(owner, Collection) and owner.python is dict:
            yield from key_problems(index, owner, self.scope)
        name = index.value if isinstance(index, ast.Constant) else None
        if isinstance(name, str) and isinstance(owner, Ports | Parameters):
            found = attribute_problem(self.types, owner, name)
            if found is not None:
                yield CodeProblem(found[0], found[1], self._span(index), found[2])

    # --- values

    def _assignment(self, target: ast.expr, value: ast.expr) -> Iterator[CodeProblem]:
        if isinstance(target, ast.Subscript):
            yield from stored_problems(target, value, self.scope)
            return
        if isinstance(target, ast.Tuple):
            yield from self._unpacked(target, value)
        if not isinstance(target, ast.Attribute):
            return
        owner = self.scope.type_of(target.value)
        if isinstance(owner, Self | OwnObject):
            expected = (
                self.types.annotation(target.attr)
                if isinstance(owner, Self)
                else annotation_of(self.scope, owner.of, target.attr)
            )
            wrong = argument_problem(value, self.scope.type_of(value), expected, self.scope.type_of)
            if wrong is not None:
                problem = f"attribute '{target.attr}': {wrong}"
                place = problem_place(value, expected, self.scope.type_of)
                yield CodeProblem(Kind.VALUE, problem, self._span(place))
            return
        message = owner if isinstance(owner, Message) else None
        field = message.field(target.attr) if message is not None else None
        if field is not None:
            yield from self._values.field(value, field)

    def _unpacked(self, target: ast.Tuple, value: ast.expr) -> Iterator[CodeProblem]:
        """Check what is unpacked into fields of messages, as in ``point.x, point.y = START``."""
        found = self.scope.type_of(value)
        if isinstance(found, Pending):
            yield from pending_value(value, self.function, self.scope)
        items = found.items if isinstance(found, Collection) and found.items is not None else ()
        for item, type_ in zip(target.elts, items, strict=False):
            if not isinstance(item, ast.Attribute):
                continue
            owner = self.scope.type_of(item.value)
            field = owner.field(item.attr) if isinstance(owner, Message) else None
            if field is not None:
                wrong = value_problem(value, type_, field.type, self.types.interfaces)
                if wrong is not None:
                    message = f"'{ast.unparse(item)}': {wrong[0]}"
                    span = self._span(self._item(value, target.elts.index(item)))
                    yield CodeProblem(Kind.VALUE, message, span, wrong[1])
                    return

    def _item(self, value: ast.expr, position: int) -> ast.expr:
        """Return the item of a constant of the file that a name means, or else the name."""
        constant = None
        if isinstance(value, ast.Name) and not self.scope.is_local(value.id):
            constant = constant_named(value.id, self.scope.home)
        return constant.elts[position] if isinstance(constant, ast.Tuple) else value

    def _annotated(self, annotation: ast.expr, value: ast.expr) -> Iterator[CodeProblem]:
        expected = self.scope.annotated(annotation, self.scope.home)
        found = self.scope.type_of(value)
        wrong = argument_problem(value, found, expected, self.scope.type_of)
        wrong = wrong or default_problem(value, expected, self.scope)
        if wrong is not None:
            place = problem_place(value, expected, self.scope.type_of)
            yield CodeProblem(Kind.VALUE, wrong, self._span(place))

    def _returned(self) -> Iterator[CodeProblem]:
        """Check what a function returns; None has a rule of its own in handlers of services."""
        returns = self.handler.returns if self.handler is not None else ANYTHING
        if isinstance(returns, Message):
            for value in returned_values(self.function):
                yield from self._values.value(value, returns)
        if isinstance(self.types, HostedTypes):
            yield from must_return(self.function, self.scope, returns)
            return
        is_service = self.handler is not None and len(self.handler.arguments) > 1
        if is_service and isinstance(returns, Message):
            return
        if self.handler is None and self.scope.of_class is None:
            yield from transition_results(self.function, self.scope)
        yield from return_problems(self.function, self.scope, self.handler)

    # --- annotations

    def _annotations(self) -> Iterator[CodeProblem]:
        arguments = self.function.args
        positional = (*arguments.posonlyargs, *arguments.args)[1:]
        given = self.handler.arguments if self.handler is not None else ()
        for argument, type_ in zip(positional, given, strict=False):
            if argument.annotation is None or not isinstance(type_, Message):
                continue
            scope = self.scope
            home, node = scope.home, self.types.node
            found = annotated(argument.annotation, home, node, self.types.interfaces)
            named = scope.type_of(argument.annotation)
            if isinstance(named, InterfaceClass) and not isinstance(named.definition, Message):
                found = named  # a service or an action
            wrong = found.definition if isinstance(found, InterfaceClass) else found
            if isinstance(wrong, Message | Service | Action) and wrong != type_:
                yield CodeProblem(
                    Kind.ANNOTATION,
                    f"'{self.function.name}' gets a {type_.name}, not a {wrong.name}",
                    self._span(argument.annotation),
                )

    def _span(self, node: ast.expr) -> Span:
        return span_of(node, self.scope.home.source)
