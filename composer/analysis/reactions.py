"""Every reaction of a system, and what is sent in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from composer.model import Event, Node, Port, Reaction, Send, System


@dataclass(frozen=True, slots=True)
class ReactionSite:
    """A reaction, the node that reacts, what to, and the port it comes through, if any."""

    node: Node
    event: Event
    reaction: Reaction
    port: Port | None = None


def reactions(system: System) -> Iterator[ReactionSite]:
    """Yield every reaction: of ports, of timers, to lifecycle transitions."""
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
    """Yield every message, request and goal sent in a reaction, with the key it stands under."""
    for site in reactions(system):
        for send in site.reaction.publish:
            yield site, "publish", send
        for send in site.reaction.call:
            yield site, "call", send
