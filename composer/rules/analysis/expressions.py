"""Reactions and expressions of a system, and problems with the message fields in them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from composer.base.diagnostics import Diagnostic
from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Message
from composer.interfaces.field_types.checker import FieldChecker
from composer.interfaces.field_types.types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STATUS,
    STRING,
    UNKNOWN_FIELD,
    ValueType,
    constant_problem,
    described,
    is_bool,
    is_number,
    is_string,
    parameter_type,
    problem_at,
    type_of,
)
from composer.language.expressions import Expression
from composer.language.templates import Constant, Items, Template, expressions_in
from composer.model import Event, Node, PeriodError, Port, PortKind, Reaction, Send, System, Timer
from composer.rules.analysis.context import Context
from composer.rules.analysis.parameters import has_wrong_default, wrong_choices

#: The kinds of ports that the keys of a reaction send through.
SENDERS = {
    "publish": (PortKind.PUBLISHER,),
    "call": (PortKind.CLIENT, PortKind.ACTION_CLIENT),
}
#: Names that every reaction can use.
COMMON_NAMES = ("parameters", "state", "count", "now", "node")
#: Further names that a reaction can use, by event.
EVENT_NAMES: dict[Event, tuple[str, ...]] = {
    Event.MESSAGE: ("message",),
    Event.REQUEST: ("request",),
    Event.RESPONSE: ("response", "request"),
    Event.GOAL: ("goal",),
    Event.FEEDBACK: ("feedback",),
    Event.RESULT: ("result", "status"),
    Event.FAILURE: ("failure",),
}
#: Names that a timer's period can use; it is evaluated before any event.
PERIOD_NAMES = ("parameters",)
_KINDS = (is_number, is_bool, is_string)


@dataclass(frozen=True, slots=True)
class ReactionSite:
    """A reaction with its node and event, and the port that the event belongs to, if any."""

    node: Node
    event: Event
    reaction: Reaction
    port: Port | None = None


def reactions(system: System) -> Iterator[ReactionSite]:
    """Yield every reaction: of ports, of timers and to lifecycle transitions."""
    for node in system.nodes:
        for port in node.ports:
            for event, reaction in port.reactions:
                yield ReactionSite(node, event, reaction, port)
        for timer in node.timers:
            if timer.reaction is not None:
                yield ReactionSite(node, Event.TIMER, timer.reaction)
        for event, reaction in node.reactions:
            yield ReactionSite(node, event, reaction)


def sends(system: System) -> Iterator[tuple[ReactionSite, str, Send]]:
    """Yield every message, request and goal that reactions send, with its key in the YAML."""
    for site in reactions(system):
        for send in site.reaction.publish:
            yield site, "publish", send
        for send in site.reaction.call:
            yield site, "call", send


def message_templates(context: Context) -> tuple[tuple[Template, Message], ...]:
    """Return the templates of all messages, requests, responses, feedback and results."""
    return tuple(_message_templates(context))


def _message_templates(context: Context) -> Iterator[tuple[Template, Message]]:
    for site in reactions(context.system):
        for send in (*site.reaction.publish, *site.reaction.call):
            message = context.sent(site.node.port(send.port.value))
            if message is not None:
                yield send.content, message
        response = context.messages(site.port).get("response")
        if site.reaction.respond is not None and response is not None:
            yield site.reaction.respond, response
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.ACTION_SERVER):
            yield from _goal_templates(context, port)


def _goal_templates(context: Context, port: Port) -> Iterator[tuple[Template, Message]]:
    messages = context.messages(port)
    for content, part in contents_of_goal(port):
        if part in messages:
            yield content, messages[part]


def contents_of_goal(port: Port) -> Iterator[tuple[Template, str]]:
    """Yield what an action server sends, with ``feedback`` or ``result``."""
    if port.feedback is not None and port.feedback.content is not None:
        yield port.feedback.content, "feedback"
    if port.result is not None:
        yield port.result, "result"


@dataclass(frozen=True, slots=True)
class ExpressionSite:
    """An expression with its span, its node and the names in scope.

    ``event`` and ``port`` determine the types of the names that belong to an event.
    """

    node: Node
    expression: Expression
    span: Span
    names: tuple[str, ...]
    event: Event | None = None
    port: Port | None = None


def expression_sites(context: Context) -> tuple[ExpressionSite, ...]:
    """Return every expression: in reactions, action servers and periods."""
    return tuple(_sites(context.system))


def _sites(system: System) -> Iterator[ExpressionSite]:
    for found in reactions(system):
        names = names_at(found.event)
        for expression, span in found.reaction.expressions():
            yield ExpressionSite(found.node, expression, span, names, found.event, found.port)
    for node in system.nodes:
        for port in node.ports:
            for expression, span in _goal_expressions(port):
                yield ExpressionSite(node, expression, span, names_at(Event.GOAL), Event.GOAL, port)
        for timer in node.timers:
            if isinstance(timer.period.value, Expression):
                yield ExpressionSite(node, timer.period.value, timer.period.span, PERIOD_NAMES)


def names_at(event: Event) -> tuple[str, ...]:
    """Return the names that a reaction to ``event`` can use."""
    return (*EVENT_NAMES.get(event, ()), *COMMON_NAMES)


def _goal_expressions(port: Port) -> Iterator[tuple[Expression, Span]]:
    """Yield the expressions of an action server that are not in its reactions."""
    if port.accept is not None:
        yield port.accept.value, port.accept.span
    for content, _ in contents_of_goal(port):
        yield from expressions_in(content)


class _NameTypes(dict[str, ValueType]):
    """Names and their types; an unknown name has an unknown type.

    Unknown names are reported by other rules, which know what is valid.
    """

    def __missing__(self, name: str) -> ValueType:
        return ANYTHING

    def __contains__(self, name: object) -> bool:
        # A name with dots is the name of a parameter, not a field of a shorter name.
        return super().__contains__(name) or "." not in str(name)

    def get(self, name: str, _default: Any = None) -> Any:
        return self[name]


@dataclass(frozen=True, slots=True)
class FieldProblem:
    """A problem, and the port whose type it depends on, as node and port."""

    problem: Diagnostic
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
) -> Iterator[Diagnostic]:
    """Check an expression that must be a number, or a string that contains one."""
    problems = list(checker.number(expression, timer.period.span))
    try:
        timer.period.evaluate(node.initial_parameters)
    except PeriodError:
        yield from problems
    else:
        yield from (problem for problem in problems if problem.rule is UNKNOWN_FIELD)


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
) -> Iterator[Diagnostic]:
    reaction = site.reaction
    if reaction.when is not None:
        yield from checker.condition(reaction.when.value, reaction.when.span)
    for name, content in reaction.state:
        found = list(checker.text(content))
        yield from found or _state(content, states.get(name.value, ANYTHING), checker)
    if reaction.log is not None:
        yield from checker.text(reaction.log)
    if reaction.respond is not None:
        response = context.messages(site.port).get("response")
        yield from _filled(checker, reaction.respond, response)


def _state(content: Template, initial: ValueType, checker: FieldChecker) -> Iterator[Diagnostic]:
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
        yield problem_at(content.span, f"{message}, as the initial value is one", hint)


def _sends(
    context: Context, checker: FieldChecker, node: Node, reaction: Reaction
) -> Iterator[FieldProblem]:
    for send in (*reaction.publish, *reaction.call):
        at = (node.name.value, send.port.value)
        message = context.sent(node.port(send.port.value))
        for problem in _filled(checker, send.content, message):
            yield FieldProblem(problem, at)


def _filled(
    checker: FieldChecker, content: Template, message: Message | None
) -> Iterator[Diagnostic]:
    return checker.text(content) if message is None else checker.template(content, message)


def _action_server(context: Context, checker: FieldChecker, port: Port) -> Iterator[Diagnostic]:
    if port.accept is not None:
        yield from checker.condition(port.accept.value, port.accept.span)
    messages = context.messages(port)
    for content, part in contents_of_goal(port):
        yield from _filled(checker, content, messages.get(part))
