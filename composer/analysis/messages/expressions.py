"""The expressions of a system, with the names in their scope."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from composer.analysis.context import Context
from composer.analysis.messages.reactions import reactions
from composer.expressions import Expression
from composer.fast_dataclass import dataclass
from composer.model import Event, Node, Port, Reaction, System
from composer.source import Span
from composer.templates import Template, expressions_in

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
    """Yield the expressions of an action server other than those of its reactions."""
    if port.accept is not None:
        yield port.accept, port.accept_span or port.span
    steps = port.feedback.content if port.feedback is not None else None
    yield from _in_templates((steps, port.result))


def _in_templates(templates: Iterable[Template | None]) -> Iterator[tuple[Expression, Span]]:
    for template in templates:
        if template is not None:
            yield from expressions_in(template)
