"""The reactions of a system, and the messages that they fill."""

from __future__ import annotations

from collections.abc import Iterator

from composer.analysis.context import Context
from composer.fast_dataclass import dataclass
from composer.interfaces import Action, Message, Service
from composer.model import Event, Node, Port, PortKind, Reaction, Send, System
from composer.templates import Template


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


def message_templates(context: Context) -> Iterator[tuple[Template, Message]]:
    """Yield the templates of all messages, requests, responses, feedback and results."""
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
