"""The generic lifecycle node: any node of any system, created from its model.

It creates its ports when it is configured, opens them when it is activated, and destroys them when
it is cleaned up, shut down, or has failed.
"""

from __future__ import annotations

from collections.abc import Awaitable, Iterator, Mapping
from copy import deepcopy
from typing import Any, TypeVar

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from composer.behavior import TransitionFailed
from composer.model import (
    BehaviorReference,
    Event,
    Node,
    PeriodError,
    Port,
    PortKind,
    Reaction,
    Timer,
)
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.reactions import (
    MessageReaction,
    ReactionClient,
    RunningReaction,
)
from composer.runtime.executors.tracebacks import calls_user_code, shown
from composer.runtime.intra_process.publisher import GatedPublisher
from composer.runtime.node.behavior_loader import (
    NodeClock,
    ParameterValues,
    behavior_class,
    method,
    named_ports,
)
from composer.runtime.node.local_node import LibraryNode, LocalNode
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.node.options import NodeOptions
from composer.runtime.node.parameters import NodeParameters
from composer.runtime.node.transforms import Broadcasts, NodeTransforms
from composer.runtime.ports import PortSet, RunningPort
from composer.runtime.ports.action_client import ActionClientPort
from composer.runtime.ports.action_server import ActionServerPort
from composer.runtime.ports.goals import Handlers
from composer.runtime.ports.services import ClientPort, ServicePort
from composer.runtime.ports.timer import TimerPort
from composer.runtime.ports.topics import PublisherPort, SubscriptionPort
from composer.runtime.ros.messages import interface_class
from composer.runtime.transforms.listener import TransformListeners

_EVENTS = {
    "configure": Event.CONFIGURE,
    "activate": Event.ACTIVATE,
    "deactivate": Event.DEACTIVATE,
    "cleanup": Event.CLEANUP,
}
P = TypeVar("P", bound=RunningPort)


class WrongReturn(Exception):
    """A lifecycle handler returned something other than None, True or False."""


class Failed(Exception):
    """The node has reported during a transition that it has failed."""


class RunningNode(LocalNode):
    """A node with reactions and, where it has one, a behavior."""

    _entities: NodeEntities

    def __init__(self, model: Node, options: NodeOptions) -> None:
        """Join the ROS graph, unconfigured. Raises ParameterError."""
        super().__init__(model, options)
        self._behavior: Any = None
        self._cleaned_up_behavior: Any = None  # for ``on_shutdown``
        self._failures: list[str] | None = None  # reported while a lifecycle handler runs
        self._failed_in = -1  # the activation in which it has last reported a failure
        self._make_library_node = options.make_library_node
        self._instruments = options.instruments
        self._library: LibraryNode | None = None
        self._listeners = options.process.transforms
        self._entities = NodeEntities(self._context, self._always_on_context)
        parameters = NodeParameters(
            self._ros, model.parameters, check=self._check_timers, changed=self._parameters_changed
        )
        self._context.names["parameters"] = parameters.values
        self._join()

    # --- transitions

    async def _configure(self) -> None:
        """Create a new behavior and new entities, so that nothing of an earlier life remains."""
        self._cleaned_up_behavior = None
        state = self._context.names["state"]
        state.clear()
        state.update({name.value: deepcopy(value) for name, value in self.model.state})
        # A callback group never forgets its entities, so an old one is not used again.
        self._context.group = self._always_on_context.group = MutuallyExclusiveCallbackGroup()
        self._entities = NodeEntities(self._context, self._always_on_context)
        reference = self.model.behavior
        behavior = None if reference is None else self._make_behavior(reference)
        try:
            self._entities.create(self.model, behavior, self._listeners)
        finally:
            if behavior is not None:
                self._set_attributes(behavior, self._entities)
                self._behavior = behavior  # only now that it is complete

    @calls_user_code
    def _make_behavior(self, reference: BehaviorReference) -> Any:
        behavior = behavior_class(reference)()
        if self._instruments is not None:
            self._instruments.behavior(self.model, behavior)
        return behavior

    def _set_attributes(self, behavior: Any, entities: NodeEntities) -> None:
        behavior.name = self.full_name
        behavior.log = self._context.log
        behavior.clock = NodeClock(self._context, self._always_on_context)
        behavior.parameters = ParameterValues(self._context.names["parameters"])
        behavior.publishers = named_ports("publisher", entities.senders)
        behavior.clients = named_ports("client", entities.clients)
        behavior.action_clients = named_ports("action client", entities.action_clients)
        if entities.transforms is not None:
            behavior.transforms = entities.transforms
        if not hasattr(behavior, "fail"):
            behavior.fail = self.fail
        if not hasattr(behavior, "node"):
            library: LibraryNode = self._make_library_node(self)
            self._library, entities.of_libraries = library, library.entities
            behavior.node = library.node
        self._set_used(behavior, behavior.publishers, *entities.senders.values())

    def fail(self, reason: str) -> None:
        """Report that the node has failed; see :class:`composer.behavior.Fail`."""
        failures = self._failures
        if failures is not None:
            failures.append(str(reason))
        elif self._failed_in != self.activations:  # a timer calls it again until the node is down
            self._failed_in = self.activations
            super().fail(str(reason))

    def _set_used(self, *used: object) -> None:
        self._context.hot_objects = self._always_on_context.hot_objects = used

    async def _call_user(self, transition: str) -> None:
        if transition == "shutdown" and self._behavior is None:
            self._behavior = self._cleaned_up_behavior
        if transition == "activate" and self._entities.transforms is not None:
            self._entities.transforms.begin()
        await self._call_handler(transition)

    async def _call_user_on_error(self, cause: BaseException) -> None:
        await self._call_handler("error", cause)

    @calls_user_code
    async def _call_handler(self, transition: str, *arguments: Any) -> None:
        event = _EVENTS.get(transition)
        reaction = self._entities.transitions.get(event) if event is not None else None
        if reaction is not None:
            reaction.run()
        name = f"on_{transition}"
        handler = method(self._behavior, name)
        if handler is None:
            return
        failures: list[str] = []
        self._failures = failures
        try:
            result = handler(*arguments)
            if isinstance(result, Awaitable):
                result = await result
        finally:
            self._failures = None
        if failures:
            raise Failed(failures[0])
        if self._context.mutations is not None:
            self._context.mutations.check(name)
        if result is None or result is True:
            return
        if result is False:
            raise TransitionFailed(f"{name} returned False")
        text = f"{name} returned {shown(result)}; None and True mean done, False refused"
        raise WrongReturn(text)

    def _discard(self, outcome: TransitionOutcome | None) -> None:
        is_clean = outcome is not None and outcome.transition == "cleanup" and outcome.success
        self._cleaned_up_behavior = self._behavior if is_clean else None
        self._entities = NodeEntities(self._context, self._always_on_context)
        if self._library is not None:
            self._library.end()
            self._library = None
        self._behavior = None
        self._set_used()

    # --- parameters

    def _check_timers(self, values: Mapping[str, Any]) -> str | None:
        """Return why a timer cannot use the new parameter values, or None."""
        for timer in self.model.timers:
            try:
                timer.period.seconds(values)
            except PeriodError as error:
                return f"timer '{timer.name}': {error}"
        return None

    def _parameters_changed(self, changes: Mapping[str, Any]) -> None:
        self._context.strand.post(lambda: self._follow_parameters(changes))

    def _follow_parameters(self, changes: Mapping[str, Any]) -> None:
        for port in self._entities.ports:
            if isinstance(port, TimerPort):
                port.follow_parameters()
        handler = method(self._behavior, "on_parameters")
        if handler is not None:
            rest = self._context.call("on_parameters", handler, changes)
            if rest is not None:
                self._context.spawn(self._context.strand.wrap(rest))


class NodeEntities(PortSet):
    """The ports and timers of a configured node, and its reactions to transitions.

    Ports that send come first, then ports that receive, timers, and the ports of libraries.
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
