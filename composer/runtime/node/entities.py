"""Creates the ports and timers of a node from its model and binds reactions and handlers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeVar

from composer.model import Event, Node, Port, PortKind, Reaction, Timer
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import (
    MessageReaction,
    ReactionClient,
    RunningReaction,
)
from composer.runtime.intra_process.publisher import GatedPublisher
from composer.runtime.node.behavior_loader import method
from composer.runtime.node.transforms import Broadcasts, NodeTransforms
from composer.runtime.ports import PortSet, RunningPort
from composer.runtime.ports.action_client import ActionClientPort
from composer.runtime.ports.action_server import ActionServerPort
from composer.runtime.ports.client import ClientPort
from composer.runtime.ports.goals import Handlers
from composer.runtime.ports.service import ServicePort
from composer.runtime.ports.timer import TimerPort
from composer.runtime.ports.topics import PublisherPort, SubscriptionPort
from composer.runtime.ros.messages import interface_class
from composer.runtime.transforms.listener import TransformListeners

P = TypeVar("P", bound=RunningPort)


class NodeEntities(PortSet):
    """The ports and timers of a configured node, and its reactions to transitions.

    Those that send come first, then those that receive, timers, those of libraries.
    ``always_on_context`` is for ports and timers that are always on; only its gate differs.
    """

    def __init__(self, context: NodeContext, always_on_context: NodeContext) -> None:
        super().__init__()
        self._context = context
        self._always_on_context = always_on_context
        self.publishers: dict[str, PublisherPort] = {}
        self.clients: dict[str, ClientPort] = {}
        self.action_clients: dict[str, ActionClientPort] = {}
        self.transitions: dict[Event, RunningReaction] = {}
        self.transforms: NodeTransforms | None = None
        self.of_libraries = PortSet()  # created with the behavior's `node`

    @property
    def senders(self) -> dict[str, GatedPublisher]:
        """What reactions and behaviors publish with, by the name of the publisher."""
        return {name: port.gated for name, port in self.publishers.items()}

    @property
    def ports(self) -> Iterator[RunningPort]:
        """All ports, timers and entities of libraries."""
        yield from super().ports
        yield from self.of_libraries.ports

    def create(self, model: Node, behavior: object | None, listeners: TransformListeners) -> None:
        """Create the entities of ``model``; if one fails, those created before it remain.

        Raises MessageError, PeriodError, and exceptions of rclpy.
        """
        self._log_dds_ports(model)
        for port in model.ports_of(PortKind.PUBLISHER):
            publisher = PublisherPort(self._context_of(port), port)
            self.publishers[port.name.value] = self._added(publisher, port)
        for port in model.ports_of(PortKind.CLIENT):
            client = ClientPort(self._context_of(port), port)
            self.clients[port.name.value] = self._added(client, port)
        for port in model.ports_of(PortKind.ACTION_CLIENT):
            action_client = ActionClientPort(self._context_of(port), port)
            self.action_clients[port.name.value] = self._added(action_client, port)
        if model.transforms is not None:
            self.transforms = NodeTransforms(self._context, model.transforms, listeners)
            self.add(self.transforms, self.transforms)
        self._bind_responses(model)
        for port in model.ports_of(PortKind.SUBSCRIPTION, PortKind.SERVICE, PortKind.ACTION_SERVER):
            self._added(self._receiver(port, behavior), port)
        for timer in model.timers:
            reaction = self._reaction(timer.reaction)
            handler = method(behavior, f"on_{timer.name.value}")
            self._added(TimerPort(self._context_of(timer), timer, reaction, handler), timer)
        for event, declared in model.reactions:
            self.transitions[event] = self._compile(declared)

    def _added(self, port: P, declared: Port | Timer) -> P:
        self.add(port, port, always_on=declared.always_on)
        return port

    def _log_dds_ports(self, model: Node) -> None:
        for port in model.ports:
            objection = self._context.router.dds_reason(port)
            if objection is not None:
                self._context.log.debug(f"{port.kind} '{port.name}' uses DDS only: {objection}")

    def _context_of(self, declared: Port | Timer) -> NodeContext:
        return self._always_on_context if declared.always_on else self._context

    def _bind_responses(self, model: Node) -> None:
        for port in model.ports_of(PortKind.CLIENT):
            for event, declared in port.reactions:
                self.clients[port.name.value].react(event, self._compile(declared))
        for port in model.ports_of(PortKind.ACTION_CLIENT):
            for event, declared in port.reactions:
                self.action_clients[port.name.value].react(event, self._compile(declared))

    def _receiver(self, port: Port, behavior: object | None) -> RunningPort:
        name = port.name.value
        context = self._context_of(port)
        handler = method(behavior, f"on_{name}")
        if port.kind is PortKind.SUBSCRIPTION:
            return SubscriptionPort(context, port, self._on_message(port), handler)
        if port.kind is PortKind.SERVICE:
            response_type = interface_class(port.interface.value).Response
            reaction = self._reaction(port.reaction(Event.REQUEST), response_type)
            return ServicePort(context, port, reaction, handler)
        reaction = self._reaction(port.reaction(Event.GOAL))
        handlers = Handlers(handler, method(behavior, f"accept_{name}"))
        return ActionServerPort(context, port, reaction, handlers)

    def _reaction(
        self, declared: Reaction | None, response_type: Any = None
    ) -> RunningReaction | None:
        return None if declared is None else self._compile(declared, response_type)

    def _on_message(self, port: Port) -> MessageReaction | None:
        """Return what a message triggers before the handler: broadcasts, and the reaction."""
        reaction = self._reaction(port.reaction(Event.MESSAGE))
        if self.transforms is None:
            return reaction
        broadcasts = tuple(self.transforms.broadcaster.from_messages(port))
        return Broadcasts(broadcasts, reaction) if broadcasts else reaction

    def _compile(self, declared: Reaction, response_type: Any = None) -> RunningReaction:
        callers: dict[str, ReactionClient] = {**self.clients, **self.action_clients}
        return RunningReaction(self._context, declared, self.senders, callers, response_type)
