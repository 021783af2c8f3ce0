"""Creates the ports and timers of a node from its model and binds reactions and handlers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any

from composer.base.fast_dataclass import dataclass
from composer.model import Event, Node, Port, PortKind, Reaction, Timer
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import (
    MessageReaction,
    ReactionClient,
    RunningReaction,
)
from composer.runtime.intra_process.publisher import GatedPublisher
from composer.runtime.node.behavior_loader import method
from composer.runtime.node.local_node import Entities, RunningPort
from composer.runtime.node.transforms import Broadcasts, NodeTransforms
from composer.runtime.ports.action_client import ActionClientPort
from composer.runtime.ports.action_server import ActionServerPort, Handlers
from composer.runtime.ports.client import ClientPort
from composer.runtime.ports.publisher import PublisherPort
from composer.runtime.ports.service import ServicePort
from composer.runtime.ports.subscription import SubscriptionPort
from composer.runtime.ports.timer import TimerPort
from composer.runtime.ros.messages import interface_class
from composer.runtime.transforms.listener import TransformListeners


@dataclass(slots=True)
class NodeEntities:
    """The entities of a configured node, by name, and its reactions to transitions.

    ``always_on_context`` is for ports and timers that are always on; only its gate differs.
    """

    context: NodeContext
    always_on_context: NodeContext
    publishers: dict[str, PublisherPort] = field(default_factory=dict)
    clients: dict[str, ClientPort] = field(default_factory=dict)
    action_clients: dict[str, ActionClientPort] = field(default_factory=dict)
    action_servers: dict[str, ActionServerPort] = field(default_factory=dict)
    subscriptions: dict[str, SubscriptionPort] = field(default_factory=dict)
    services: dict[str, ServicePort] = field(default_factory=dict)
    timers: dict[str, TimerPort] = field(default_factory=dict)
    transitions: dict[Event, RunningReaction] = field(default_factory=dict)
    always_on: list[RunningPort] = field(default_factory=list)
    transforms: NodeTransforms | None = None
    of_libraries: Entities | None = None  # created with the behavior's `node`

    @property
    def senders(self) -> dict[str, GatedPublisher]:
        """What reactions and behaviors publish with, by the name of the publisher."""
        return {name: port.gated for name, port in self.publishers.items()}

    @property
    def ports(self) -> Iterator[RunningPort]:
        """All ports: first those that send, then those that receive, timers, those of libraries."""
        yield from self.publishers.values()
        yield from self.clients.values()
        yield from self.action_clients.values()
        yield from self.subscriptions.values()
        yield from self.services.values()
        yield from self.action_servers.values()
        yield from self.timers.values()
        if self.transforms is not None:
            yield self.transforms
        if self.of_libraries is not None:
            yield from self.of_libraries.ports

    @property
    def gated(self) -> Iterator[RunningPort]:
        """The ports and timers that work only while the node is active."""
        return (port for port in self.ports if port not in self.always_on)

    def create(self, model: Node, behavior: object | None, listeners: TransformListeners) -> None:
        """Create the entities of ``model``; if one fails, those created before it remain.

        Raises MessageError, PeriodError, and exceptions of rclpy.
        """
        self._log_dds_ports(model)
        for port in model.ports_of(PortKind.PUBLISHER):
            self.publishers[port.name.value] = PublisherPort(self._context_of(port), port)
        for port in model.ports_of(PortKind.CLIENT):
            self.clients[port.name.value] = ClientPort(self._context_of(port), port)
        for port in model.ports_of(PortKind.ACTION_CLIENT):
            self.action_clients[port.name.value] = ActionClientPort(self._context_of(port), port)
        if model.transforms is not None:
            self.transforms = NodeTransforms(self.context, model.transforms, listeners)
        self._bind_responses(model)
        for port in model.ports_of(PortKind.SUBSCRIPTION, PortKind.SERVICE, PortKind.ACTION_SERVER):
            self._add_receiver(port, behavior)
        for timer in model.timers:
            name = timer.name.value
            reaction = self._reaction(timer.reaction)
            handler = method(behavior, f"on_{name}")
            self.timers[name] = TimerPort(self._context_of(timer), timer, reaction, handler)
        for event, declared in model.reactions:
            self.transitions[event] = self._compile(declared)
        self.always_on.extend(self._always_on(model))

    def _log_dds_ports(self, model: Node) -> None:
        for port in model.ports:
            objection = self.context.router.dds_reason(port)
            if objection is not None:
                self.context.log.debug(f"{port.kind} '{port.name}' uses DDS only: {objection}")

    def _context_of(self, declared: Port | Timer) -> NodeContext:
        return self.always_on_context if declared.always_on else self.context

    def _always_on(self, model: Node) -> Iterator[RunningPort]:
        sections: dict[PortKind, Mapping[str, RunningPort]] = {
            PortKind.PUBLISHER: self.publishers,
            PortKind.CLIENT: self.clients,
            PortKind.ACTION_CLIENT: self.action_clients,
            PortKind.SUBSCRIPTION: self.subscriptions,
            PortKind.SERVICE: self.services,
            PortKind.ACTION_SERVER: self.action_servers,
        }
        for port in model.ports:
            if port.always_on:
                yield sections[port.kind][port.name.value]
        for timer in model.timers:
            if timer.always_on:
                yield self.timers[timer.name.value]

    def _bind_responses(self, model: Node) -> None:
        for port in model.ports_of(PortKind.CLIENT):
            for event, declared in port.reactions:
                self.clients[port.name.value].react(event, self._compile(declared))
        for port in model.ports_of(PortKind.ACTION_CLIENT):
            for event, declared in port.reactions:
                self.action_clients[port.name.value].react(event, self._compile(declared))

    def _add_receiver(self, port: Port, behavior: object | None) -> None:
        name = port.name.value
        context = self._context_of(port)
        handler = method(behavior, f"on_{name}")
        match port.kind:
            case PortKind.SUBSCRIPTION:
                reaction = self._on_message(port)
                self.subscriptions[name] = SubscriptionPort(context, port, reaction, handler)
            case PortKind.SERVICE:
                response_type = interface_class(port.interface.value).Response
                reaction = self._reaction(port.reaction(Event.REQUEST), response_type)
                self.services[name] = ServicePort(context, port, reaction, handler)
            case PortKind.ACTION_SERVER:
                reaction = self._reaction(port.reaction(Event.GOAL))
                handlers = Handlers(handler, method(behavior, f"accept_{name}"))
                self.action_servers[name] = ActionServerPort(context, port, reaction, handlers)

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
        return RunningReaction(self.context, declared, self.senders, callers, response_type)
