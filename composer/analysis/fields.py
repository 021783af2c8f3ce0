"""Problems with message fields, in expressions and in the messages that reactions fill."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from composer.analysis.context import Context
from composer.analysis.expressions import COMMON_NAMES, EVENT_NAMES
from composer.analysis.reactions import ReactionSite, reactions
from composer.expressions import Expression
from composer.field_types import (
    ANYTHING,
    BOOL,
    INTEGER,
    NUMBER,
    STATUS,
    STRING,
    FieldChecker,
    Problem,
    ValueType,
    constant_problem,
    parameter_type,
    type_of,
)
from composer.interfaces import Action, Interfaces, Message, Service
from composer.model import Event, Node, Parameter, Port, Reaction
from composer.templates import Constant
from composer.tree import Plain


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


def field_problems(context: Context) -> tuple[Problem, ...]:
    """Return all problems with fields and their values."""
    return tuple(_problems(context))


def _problems(context: Context) -> Iterator[Problem]:
    known = {node.name.value: _node_names(node) for node in context.system.nodes}
    for site in reactions(context.system):
        scope = _scope(context, known[site.node.name.value], site.event, site.port)
        yield from _reaction(context, FieldChecker(context.interfaces, scope), site)
    for node in context.system.nodes:
        for port in node.ports:
            if port.accept is not None or port.feedback is not None or port.result is not None:
                scope = _scope(context, known[node.name.value], Event.GOAL, port)
                yield from _action_server(context, FieldChecker(context.interfaces, scope), port)
        for timer in node.timers:
            if isinstance(timer.period.value, Expression):
                checker = FieldChecker(context.interfaces, known[node.name.value])
                yield from checker.expression(timer.period.value, timer.period.span)


def _node_names(node: Node) -> _NameTypes:
    parameters = _NameTypes(
        {
            item.name.value: parameter_type(item.type.value, _choices(item))
            for item in node.parameters
        }
    )
    state = _NameTypes({name.value: type_of(value) for name, value in node.state})
    types: dict[str, ValueType] = dict.fromkeys(COMMON_NAMES, ANYTHING)
    types |= {"parameters": parameters, "state": state}
    types |= {"count": INTEGER, "now": NUMBER, "node": STRING}
    return _NameTypes(types)


def _choices(parameter: Parameter) -> tuple[Plain, ...]:
    return () if parameter.choices is None else parameter.choices.value


def _scope(context: Context, names: _NameTypes, event: Event, port: Port | None) -> _NameTypes:
    scope = _NameTypes(names)
    definition = context.interface(port) if port is not None else None
    for name in EVENT_NAMES.get(event, ()):
        scope[name] = _type_of_name(name, definition)
    return scope


def _type_of_name(name: str, definition: Message | Service | Action | None) -> ValueType:
    if name == "status":
        return STATUS
    if name == "failure":
        return STRING
    if isinstance(definition, Message):
        return definition
    found = getattr(definition, name, None)  # request, response, goal, feedback, result
    return found if isinstance(found, Message) else ANYTHING


def _reaction(context: Context, checker: FieldChecker, site: ReactionSite) -> Iterator[Problem]:
    reaction = site.reaction
    if reaction.when is not None:
        yield from checker.condition(reaction.when, reaction.when_span or reaction.span)
    initial = {name.value: type_of(value) for name, value in site.node.state}
    for name, content in reaction.state:
        yield from checker.text(content)
        if isinstance(content, Constant):
            yield from _state(content, initial.get(name.value, ANYTHING), checker.interfaces)
    if reaction.log is not None:
        yield from checker.text(reaction.log)
    yield from _sends(context, checker, site.node, reaction)
    if reaction.respond is not None:
        definition = context.interface(site.port) if site.port is not None else None
        if isinstance(definition, Service):
            yield from checker.template(reaction.respond, definition.response)
        else:
            yield from checker.text(reaction.respond)


def _state(value: Constant, initial: ValueType, interfaces: Interfaces) -> Iterator[Problem]:
    """Compare a constant with the initial value of its state variable."""
    expected = NUMBER if initial == INTEGER else initial
    if value.value is None or expected not in (BOOL, NUMBER, STRING):
        return
    problem = constant_problem(value.value, expected, interfaces)
    if problem is not None:
        kind = "number" if expected == NUMBER else str(expected)
        message = problem[0].replace(f"where {expected} is", f"where a {kind} is")
        yield Problem(f"{message}, as the initial value is one", value.span, problem[1])


def _sends(
    context: Context, checker: FieldChecker, node: Node, reaction: Reaction
) -> Iterator[Problem]:
    for send in (*reaction.publish, *reaction.call):
        port = node.port(send.port.value)
        match context.interface(port) if port is not None else None:
            case Message() as message:
                yield from checker.template(send.content, message)
            case Service() as service:
                yield from checker.template(send.content, service.request)
            case Action() as action:
                yield from checker.template(send.content, action.goal)
            case None:
                yield from checker.text(send.content)


def _action_server(context: Context, checker: FieldChecker, port: Port) -> Iterator[Problem]:
    if port.accept is not None:
        yield from checker.condition(port.accept, port.accept_span or port.span)
    action = context.interface(port)
    steps = port.feedback.content if port.feedback is not None else None
    parts = ((steps, "feedback"), (port.result, "result"))
    for content, part in parts:
        if content is None:
            continue
        if isinstance(action, Action):
            yield from checker.template(content, getattr(action, part))
        else:
            yield from checker.text(content)
