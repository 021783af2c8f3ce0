"""The reactions and expressions of a system, and the messages that reactions fill."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.base.fast_dataclass import dataclass
from composer.base.source import Span
from composer.interfaces import Message
from composer.language.expressions import Expression
from composer.language.templates import Template, expressions_in
from composer.model import Event, Node, Port, PortKind, Reaction, Send, System
from composer.rules.analysis.context import Context


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


#: The kinds of ports that the keys of a reaction send through.
SENDERS = {
    "publish": (PortKind.PUBLISHER,),
    "call": (PortKind.CLIENT, PortKind.ACTION_CLIENT),
}


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
        for expression, span in reaction_expressions(found.reaction):
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


def reaction_expressions(reaction: Reaction) -> Iterator[tuple[Expression, Span]]:
    """Yield the expressions of a reaction with their spans."""
    if reaction.when is not None:
        yield reaction.when, reaction.when_span or reaction.span
    message_templates = [content for _, content in reaction.state]
    message_templates += [send.content for send in (*reaction.publish, *reaction.call)]
    yield from _in_templates((*message_templates, reaction.log, reaction.respond))


def _goal_expressions(port: Port) -> Iterator[tuple[Expression, Span]]:
    """Yield the expressions of an action server that are not in its reactions."""
    if port.accept is not None:
        yield port.accept, port.accept_span or port.span
    steps = port.feedback.content if port.feedback is not None else None
    yield from _in_templates((steps, port.result))


def _in_templates(templates: Iterable[Template | None]) -> Iterator[tuple[Expression, Span]]:
    for template in templates:
        if template is not None:
            yield from expressions_in(template)
