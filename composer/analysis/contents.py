"""Everything a system fills the fields of a message with."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.analysis.reactions import reactions
from composer.interfaces import Action, Message, Service
from composer.model import Port, PortKind
from composer.templates import Template


def contents(context: Context) -> Iterator[tuple[Template, Message]]:
    """Yield what is published, sent, answered, fed back and given as result, with its message."""
    for site in reactions(context.system):
        for send in (*site.reaction.publish, *site.reaction.call):
            message = _sent(context, site.node.port(send.port.value))
            if message is not None:
                yield send.content, message
        definition = context.interface(site.port) if site.port is not None else None
        if site.reaction.respond is not None and isinstance(definition, Service):
            yield site.reaction.respond, definition.response
    for node in context.system.nodes:
        for port in node.ports_of(PortKind.ACTION_SERVER):
            yield from _of_goal(context, port)


def _sent(context: Context, port: Port | None) -> Message | None:
    match context.interface(port) if port is not None else None:
        case Message() as message:
            return message
        case Service() as service:
            return service.request
        case Action() as action:
            return action.goal
        case _:
            return None


def _of_goal(context: Context, port: Port) -> Iterator[tuple[Template, Message]]:
    action = context.interface(port)
    if not isinstance(action, Action):
        return
    if port.feedback is not None and port.feedback.content is not None:
        yield port.feedback.content, action.feedback
    if port.result is not None:
        yield port.result, action.result
