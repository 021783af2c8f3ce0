"""What is wrong with fields: in expressions, and in what is published, sent and answered."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from composer.analysis.context import Context
from composer.analysis.reactions import ReactionSite, reactions
from composer.analysis.sites import COMMON_NAMES, EVENT_NAMES
from composer.expressions import Expression
from composer.field_types import (
    ANYTHING,
    INTEGER,
    NUMBER,
    TEXT,
    Judge,
    Problem,
    ValueType,
    parameter_type,
    type_of,
)
from composer.interfaces import Action, Message, Service
from composer.model import Event, Node, Port, Reaction


class _Names(dict[str, ValueType]):
    """Names and their types; of a name that is not there nothing is known.

    That a name does not exist is for other rules to say, which know what it should have been.
    """

    def __missing__(self, name: str) -> ValueType:
        return ANYTHING

    def __contains__(self, name: object) -> bool:
        # A name with dots is a parameter's, and not the field of what the part before it holds.
        return super().__contains__(name) or "." not in str(name)

    def get(self, name: str, _default: Any = None) -> Any:
        return self[name]


def field_problems(context: Context) -> tuple[Problem, ...]:
    """Return everything that is wrong with a field or its value."""
    return tuple(_problems(context))


def _problems(context: Context) -> Iterator[Problem]:
    known = {node.name.value: _node_names(node) for node in context.system.nodes}
    for site in reactions(context.system):
        scope = _scope(context, known[site.node.name.value], site.event, site.port)
        yield from _reaction(context, Judge(context.interfaces, scope), site)
    for node in context.system.nodes:
        for port in node.ports:
            if port.accept is not None or port.feedback is not None or port.result is not None:
                scope = _scope(context, known[node.name.value], Event.GOAL, port)
                yield from _action_server(context, Judge(context.interfaces, scope), port)
        for timer in node.timers:
            if isinstance(timer.period.value, Expression):
                judge = Judge(context.interfaces, known[node.name.value])
                yield from judge.expression(timer.period.value, timer.period.span)


def _node_names(node: Node) -> _Names:
    parameters = _Names(
        {item.name.value: parameter_type(item.type.value) for item in node.parameters}
    )
    state = _Names({name.value: type_of(value) for name, value in node.state})
    types: dict[str, ValueType] = dict.fromkeys(COMMON_NAMES, ANYTHING)
    types |= {"parameters": parameters, "state": state}
    types |= {"count": INTEGER, "now": NUMBER, "node": TEXT}
    return _Names(types)


def _scope(context: Context, names: _Names, event: Event, port: Port | None) -> _Names:
    scope = _Names(names)
    definition = context.interface(port) if port is not None else None
    for name in EVENT_NAMES.get(event, ()):
        scope[name] = _type_of_name(name, definition)
    return scope


def _type_of_name(name: str, definition: Message | Service | Action | None) -> ValueType:
    if name in {"status", "failure"}:
        return TEXT
    if isinstance(definition, Message):
        return definition
    found = getattr(definition, name, None)  # request, response, goal, feedback, result
    return found if isinstance(found, Message) else ANYTHING


def _reaction(context: Context, judge: Judge, site: ReactionSite) -> Iterator[Problem]:
    reaction = site.reaction
    if reaction.when is not None:
        yield from judge.condition(reaction.when, reaction.when_span or reaction.span)
    for _, content in reaction.state:
        yield from judge.text(content)
    if reaction.log is not None:
        yield from judge.text(reaction.log)
    yield from _sends(context, judge, site.node, reaction)
    if reaction.respond is not None:
        definition = context.interface(site.port) if site.port is not None else None
        if isinstance(definition, Service):
            yield from judge.template(reaction.respond, definition.response)
        else:
            yield from judge.text(reaction.respond)


def _sends(context: Context, judge: Judge, node: Node, reaction: Reaction) -> Iterator[Problem]:
    for send in (*reaction.publish, *reaction.call):
        port = node.port(send.port.value)
        match context.interface(port) if port is not None else None:
            case Message() as message:
                yield from judge.template(send.content, message)
            case Service() as service:
                yield from judge.template(send.content, service.request)
            case Action() as action:
                yield from judge.template(send.content, action.goal)
            case None:
                yield from judge.text(send.content)


def _action_server(context: Context, judge: Judge, port: Port) -> Iterator[Problem]:
    if port.accept is not None:
        yield from judge.condition(port.accept, port.accept_span or port.span)
    action = context.interface(port)
    steps = port.feedback.content if port.feedback is not None else None
    parts = ((steps, "feedback"), (port.result, "result"))
    for content, part in parts:
        if content is None:
            continue
        if isinstance(action, Action):
            yield from judge.template(content, getattr(action, part))
        else:
            yield from judge.text(content)
