"""Problems with message fields, in expressions and in the messages that reactions fill."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.interfaces import Message
from composer.interfaces.field_types.checker import FieldChecker
from composer.interfaces.field_types.constants import constant_problem
from composer.interfaces.field_types.types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STATUS,
    STRING,
    Problem,
    ValueType,
    described,
    is_bool,
    is_number,
    is_string,
    parameter_type,
    type_of,
)
from composer.language.expressions import Expression
from composer.language.templates import Constant, Items, Template
from composer.model import Event, Node, PeriodError, Port, Reaction, Timer
from composer.rules.analysis.context import Context
from composer.rules.analysis.expressions import (
    COMMON_NAMES,
    EVENT_NAMES,
    ReactionSite,
    contents_of_goal,
    reactions,
)
from composer.rules.analysis.parameters import has_wrong_default, wrong_choices


class _NameTypes(dict[str, ValueType]):
    """Names and their types; an unknown name has an unknown type.

    Unknown names are reported by other rules, which know what is valid.
    """

    def __missing__(self, name: str) -> ValueType:
        return ANYTHING

    def __contains__(self, name: object) -> bool:
        # A name with dots is that of a parameter, not a field of a shorter name.
        return super().__contains__(name) or "." not in str(name)

    def get(self, name: str, _default: Any = None) -> Any:
        return self[name]


_KINDS = (is_number, is_bool, is_string)


@dataclass(frozen=True, slots=True)
class FieldProblem:
    """A problem, and the port whose type it depends on, as node and port."""

    problem: Problem
    port: tuple[str, str] | None = None


def field_problems(context: Context) -> tuple[FieldProblem, ...]:
    """Return all problems with fields and their values."""
    return tuple(_problems(context))


def _problems(context: Context) -> Iterator[FieldProblem]:
    nodes = context.system.nodes
    states = {node.name.value: _state_types(node) for node in nodes}
    known = {node.name.value: _node_names(node, states[node.name.value]) for node in nodes}
    for site in reactions(context.system):
        scope = _scope(context, known[site.node.name.value], site.event, site.port)
        checker = FieldChecker(context.interfaces, scope)
        own = None if site.port is None else (site.node.name.value, site.port.name.value)
        for problem in _reaction(context, checker, site, states[site.node.name.value]):
            yield FieldProblem(problem, own)
        yield from _sends(context, checker, site.node, site.reaction)
    for node in nodes:
        for port in node.ports:
            if port.accept is not None or port.feedback is not None or port.result is not None:
                scope = _scope(context, known[node.name.value], Event.GOAL, port)
                for problem in _action_server(
                    context, FieldChecker(context.interfaces, scope), port
                ):
                    yield FieldProblem(problem, (node.name.value, port.name.value))
        for timer in node.timers:
            if isinstance(timer.period.value, Expression):
                checker = FieldChecker(context.interfaces, known[node.name.value])
                for problem in _period(timer.period.value, timer, node, checker):
                    yield FieldProblem(problem)


def _period(
    expression: Expression, timer: Timer, node: Node, checker: FieldChecker
) -> Iterator[Problem]:
    """Check an expression that must be a number, or a string that contains one."""
    problems = list(checker.number(expression, timer.period.span))
    try:
        timer.period.evaluate(node.initial_parameters)
    except PeriodError:
        yield from problems
    else:
        yield from (problem for problem in problems if problem.missing)


def _state_types(node: Node) -> _NameTypes:
    return _NameTypes({name.value: type_of(value) for name, value in node.state})


def _node_names(node: Node, state: _NameTypes) -> _NameTypes:
    parameters = _NameTypes(
        {
            item.name.value: ANYTHING
            if has_wrong_default(item) or wrong_choices(item)
            else parameter_type(item.type.value, () if item.choices is None else item.choices.value)
            for item in node.parameters
        }
    )
    types: dict[str, ValueType] = dict.fromkeys(COMMON_NAMES, ANYTHING)
    types |= {"parameters": parameters, "state": state}
    types |= {"count": INTEGER, "now": NUMBER, "node": STRING}
    return _NameTypes(types)


def _scope(context: Context, names: _NameTypes, event: Event, port: Port | None) -> _NameTypes:
    scope = _NameTypes(names)
    known: dict[str, ValueType] = {"status": STATUS, "failure": STRING, **context.messages(port)}
    for name in EVENT_NAMES.get(event, ()):
        scope[name] = known.get(name, ANYTHING)
    return scope


def _reaction(
    context: Context, checker: FieldChecker, site: ReactionSite, states: _NameTypes
) -> Iterator[Problem]:
    reaction = site.reaction
    if reaction.when is not None:
        yield from checker.condition(reaction.when, reaction.when_span or reaction.span)
    for name, content in reaction.state:
        found = list(checker.text(content))
        yield from found or _state(content, states.get(name.value, ANYTHING), checker)
    if reaction.log is not None:
        yield from checker.text(reaction.log)
    if reaction.respond is not None:
        response = context.messages(site.port).get("response")
        yield from _filled(checker, reaction.respond, response)


def _state(content: Template, initial: ValueType, checker: FieldChecker) -> Iterator[Problem]:
    """Compare a new value with the initial value of its state variable."""
    expected = NUMBER if initial == INTEGER else initial
    if expected not in (BOOL, NUMBER, STRING):
        return
    kind = "number" if expected == NUMBER else str(expected)
    if isinstance(content, Constant):
        problem = None
        if content.value is not None:
            problem = constant_problem(content.value, expected, checker.interfaces)
        message, hint = problem if problem is not None else ("", None)
    elif isinstance(content, Items):
        message, hint = f"a list where {expected} is expected", None
    else:
        found = checker.type_of(content)
        fits = found == ANYTHING or any(is_a(expected) and is_a(found) for is_a in _KINDS)
        message, hint = "" if fits else f"{described(found)} where {expected} is expected", None
    if message:
        message = message.replace(f"where {expected} is", f"where a {kind} is")
        yield Problem(f"{message}, as the initial value is one", content.span, hint)


def _sends(
    context: Context, checker: FieldChecker, node: Node, reaction: Reaction
) -> Iterator[FieldProblem]:
    for send in (*reaction.publish, *reaction.call):
        at = (node.name.value, send.port.value)
        message = context.sent(node.port(send.port.value))
        for problem in _filled(checker, send.content, message):
            yield FieldProblem(problem, at)


def _filled(checker: FieldChecker, content: Template, message: Message | None) -> Iterator[Problem]:
    return checker.text(content) if message is None else checker.template(content, message)


def _action_server(context: Context, checker: FieldChecker, port: Port) -> Iterator[Problem]:
    if port.accept is not None:
        yield from checker.condition(port.accept, port.accept_span or port.span)
    messages = context.messages(port)
    for content, part in contents_of_goal(port):
        yield from _filled(checker, content, messages.get(part))
