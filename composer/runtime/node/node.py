"""The generic lifecycle node: any node of any system, created from its model.

It creates its ports when it is configured, opens them when it is activated, and destroys them when
it is cleaned up, shut down, or has failed.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping
from copy import deepcopy
from dataclasses import replace
from time import monotonic
from typing import Any, TypeVar

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node as RosNode

from composer.behavior import TransitionFailed
from composer.model import BehaviorReference, Event, Node, PeriodError
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.log import ErrorLimit, ErrorLog, Log
from composer.runtime.callbacks.mutation_check import MessageSnapshots, MutationCheck
from composer.runtime.clock.clock import NodeTime
from composer.runtime.executors.exceptions import describe, shown
from composer.runtime.executors.futures import Future
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.stacks import calls_user_code
from composer.runtime.executors.strand import InlineStrand, SerialStrand
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate, PendingFutures
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.behavior_loader import (
    NodeClock,
    behavior_class,
    method,
    named_ports,
)
from composer.runtime.node.entities import NodeEntities, RunningPort
from composer.runtime.node.lifecycle import Lifecycle
from composer.runtime.node.managed_node import NodeListener
from composer.runtime.node.options import NodeOptions
from composer.runtime.node.outcome import FINALIZED, TransitionOutcome
from composer.runtime.node.parameter_services import NodeParameterStore, ParameterServices
from composer.runtime.node.parameters import NodeParameters, ParameterValues
from composer.runtime.node.ros_node import make_ros_node

T = TypeVar("T")

_EVENTS = {
    "configure": Event.CONFIGURE,
    "activate": Event.ACTIVATE,
    "deactivate": Event.DEACTIVATE,
    "cleanup": Event.CLEANUP,
}


class WrongReturn(Exception):
    """A lifecycle handler returned something other than None, True or False."""


class RunningNode:
    """The :class:`.ManagedNode` of a behavior or of reactions alone.

    Create it before its loop is started, or on the loop.
    """

    def __init__(
        self,
        model: Node,
        loop: Loop,
        options: NodeOptions,
        listener: NodeListener,
        statistics: Statistics | None = None,
    ) -> None:
        """Join the ROS graph, unconfigured; continue ``statistics``. Raises ParameterError."""
        self.model = model
        self.loop = loop
        self.activations = 0  # how often it became active
        #: When, by ``time.monotonic()``, the work of its last transition started.
        self.transition_started_s = 0.0
        self.statistics = Statistics() if statistics is None else statistics
        self.transition_timeout_s = options.transition_timeout_s
        self._listener = listener
        self._system_is_up = options.system_is_up
        self._ros = make_ros_node(model)
        offers = model.introspection
        log = Log(self._ros, options.log_level, listener.write_log, rosout=offers.rosout)
        self._error_limit = _error_limit(model, listener)
        error_log = ErrorLog(log, self.statistics, listener.on_error, self._error_limit)
        self._context = NodeContext(
            node=self._ros,
            loop=loop,
            clock=NodeTime(self._ros, loop, options.process.simulated_time, self._time_switched),
            gate=LifecycleGate(model.full_name, PendingFutures(loop.call_later)),
            strand=SerialStrand(loop.call_soon) if options.parallel else InlineStrand(),
            log=log,
            error_log=error_log,
            statistics=self.statistics,
            names={"parameters": {}, "state": {}, "node": model.full_name},
            router=options.router,
            chains=options.chains.of(model),
            events=options.process.events,
            mutations=_mutation_check(options.seen_messages, error_log),
        )
        # Ports that are always on have a gate of their own and share the rest.
        always_on_gate = LifecycleGate(model.full_name, PendingFutures(loop.call_later))
        self._always_on_context = replace(self._context, gate=always_on_gate)
        self._behavior: Any = None
        self._cleaned_up_behavior: Any = None  # for ``on_shutdown``
        self._entities = NodeEntities(self._context, self._always_on_context)
        parameters = NodeParameters(
            self._ros, model.parameters, check=self._check_timers, changed=self._parameters_changed
        )
        self._context.names["parameters"] = parameters.values
        if offers.parameters:
            ParameterServices(self._ros, NodeParameterStore(self._ros), log.warn)
        self._keeps_entities = False
        loop.add_node(self._ros)
        self.lifecycle = Lifecycle(
            self._context,
            self,
            timeout_s=options.transition_timeout_s,
            services=offers.lifecycle_services,
        )

    @property
    def full_name(self) -> str:
        """The name ROS knows the node by."""
        return self.model.full_name

    @property
    def state(self) -> str:
        """The label of the lifecycle state, as ROS tools see it."""
        return self.lifecycle.state

    def now_s(self) -> float:
        """Return the node's time in seconds."""
        return self._context.now_s()

    def count_errors(self) -> None:
        """Count errors as faults from now on: the system is up. Thread-safe."""
        self._system_is_up = True
        if self._error_limit is not None and self.state == "active":
            self._error_limit.start()

    def block(self) -> None:
        """Block all ports of a failed node until its next transition. Thread-safe.

        In that transition the node can send last messages; it receives again after it.
        """
        if self._error_limit is not None:
            self._error_limit.paused = True  # it has failed already
        for context in self.contexts:
            context.gate.block()

    def sent(self, publisher: str) -> int:
        """Return how many messages a publisher has sent."""
        return self.statistics.publisher(publisher).count

    def limit_end(self, end_s: float) -> None:
        """Do nothing: transitions have a time limit, and the loop interrupts callbacks."""

    @property
    def callback_owners(self) -> tuple[object, ...]:
        """The objects by which a running callback on a stack is recognized as the node's."""
        return (self, *self.contexts)

    @property
    def contexts(self) -> tuple[NodeContext, NodeContext]:
        """What its parts share: those that are gated by *active*, and those that are always on."""
        return self._context, self._always_on_context

    def query(self, function: Callable[[RosNode], T]) -> Future[T]:
        """Return the result of ``function(ROS node)``, which is called on the node's loop."""

        async def call() -> T:
            return function(self._ros)

        return self.loop.run_task(call())

    def keep_entities(self) -> None:
        """Do not destroy ports from now on: the end of the process does."""
        self._keeps_entities = True

    def destroy(self) -> None:
        """Destroy the node in any state. No transition is possible afterwards."""
        self._release()
        self.lifecycle.destroy()
        self._context.clock.close()
        self.loop.remove_node(self._ros)
        self._ros.destroy_node()

    # --- hooks of the lifecycle

    async def on_transition(self, transition: str, start: str) -> None:
        """Do the work of ``transition``; raise what goes wrong."""
        self._begin_transition()
        gate = self._context.gate
        gate.state = self._always_on_context.gate.state = self.state
        gate.waiting = True
        if transition == "configure":
            self._configure()
            self._always_on_context.gate.outgoing = True
        elif transition == "activate":
            gate.outgoing = True
        elif start == "active":
            await self._deactivate(self._context, self._entities.gated)
        if transition in ("cleanup", "shutdown"):
            await self._deactivate(self._always_on_context, self._entities.always_on)
        if transition == "shutdown" and self._behavior is None:
            self._behavior = self._cleaned_up_behavior
        await self._call_handler(transition)

    async def on_error(self, cause: BaseException) -> None:
        """Call the behavior's ``on_error``."""
        self._begin_transition()
        await self._deactivate(self._context, self._entities.gated)
        await self._deactivate(self._always_on_context, self._entities.always_on)
        self._context.gate.waiting = True
        await self._call_handler("error", cause)

    def on_transition_end(self, result: TransitionOutcome) -> None:
        """Open or close the gates for the new state, and report it."""
        state = result.state
        if state == "active":
            is_activation = result.transition == "activate"
            self.activations += is_activation
            self._resume_error_limit(restart=is_activation)
        _settle(self._context.gate, state, state == "active", self._entities.gated)
        is_configured = state in ("inactive", "active")
        _settle(self._always_on_context.gate, state, is_configured, self._entities.always_on)
        if state in ("unconfigured", FINALIZED):
            is_clean = result.transition == "cleanup" and result.success
            self._cleaned_up_behavior = self._behavior if is_clean else None
            self._release()
        self._listener.on_transition_end(result)

    # --- transitions

    def _begin_transition(self) -> None:
        self.transition_started_s = monotonic()
        if self._error_limit is not None:
            self._error_limit.paused = True
        for context in self.contexts:
            context.gate.unblock_outgoing()

    def _resume_error_limit(self, *, restart: bool) -> None:
        if self._error_limit is None or not self._system_is_up:
            return
        if restart:
            self._error_limit.start()
        else:  # a refused transition
            self._error_limit.paused = False

    def _configure(self) -> None:
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
            self._entities.create(self.model, behavior)
        finally:
            if behavior is not None:
                self._set_attributes(behavior, self._entities)
                self._behavior = behavior  # only now that it is complete

    @calls_user_code
    def _make_behavior(self, reference: BehaviorReference) -> Any:
        return behavior_class(reference)()

    def _set_attributes(self, behavior: Any, entities: NodeEntities) -> None:
        behavior.name = self.full_name
        behavior.log = self._context.log
        behavior.clock = NodeClock(self._context, self._always_on_context)
        behavior.parameters = ParameterValues(self._context.names["parameters"])
        behavior.publishers = named_ports("publisher", entities.senders)
        behavior.clients = named_ports("client", entities.clients)
        behavior.action_clients = named_ports("action client", entities.action_clients)
        self._set_used(behavior, behavior.publishers, *entities.senders.values())

    def _set_used(self, *used: object) -> None:
        self._context.hot_objects = self._always_on_context.hot_objects = used

    async def _deactivate(self, context: NodeContext, ports: Iterable[RunningPort]) -> None:
        """Stop receiving and cancel what is pending. Publishers stay open for last messages."""
        context.gate.incoming = False
        deactivated = tuple(ports)
        for port in deactivated:
            port.deactivate()
        context.gate.cancel_pending()
        for server in self._entities.action_servers.values():
            if server in deactivated:
                await server.drain()

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
        result = handler(*arguments)
        if isinstance(result, Awaitable):
            result = await result
        if self._context.mutations is not None:
            self._context.mutations.check(name)
        if result is None or result is True:
            return
        if result is False:
            raise TransitionFailed(f"{name} returned False")
        text = f"{name} returned {shown(result)}; None and True mean done, False refused"
        raise WrongReturn(text)

    def _release(self) -> None:
        self._context.cancel_tasks()
        if self._keeps_entities:
            return
        for port in reversed(tuple(self._entities.ports)):
            try:
                port.destroy()
            except Exception as error:
                self._context.log.error(f"cannot destroy {type(port).__name__}: {describe(error)}")
        self._entities = NodeEntities(self._context, self._always_on_context)
        self._behavior = None
        self._set_used()

    # --- parameters

    def _time_switched(self) -> None:
        self._context.strand.post(self._follow_clock)

    def _follow_clock(self) -> None:
        for timer in self._entities.timers.values():
            timer.follow_clock()

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
        for timer in self._entities.timers.values():
            timer.follow_parameters()
        handler = method(self._behavior, "on_parameters")
        if handler is not None:
            rest = self._context.call("on_parameters", handler, changes)
            if rest is not None:
                self._context.spawn(self._context.strand.wrap(rest))


def _settle(gate: LifecycleGate, state: str, is_open: bool, ports: Iterable[RunningPort]) -> None:
    """Open or close a gate, and the ports behind it, in the primary state ``state``."""
    gate.state = state
    if is_open:
        gate.open()
        for port in ports:
            port.activate()
        return
    for port in ports:
        port.deactivate()
    gate.close()


def _error_limit(model: Node, listener: NodeListener) -> ErrorLimit | None:
    supervision = model.supervision
    max_errors = supervision.watch.max_errors
    if max_errors is None:
        return None
    window_s = supervision.restart.window_ms / 1000.0
    return ErrorLimit(max_errors.value, window_s, listener.on_error_limit)


def _mutation_check(seen: MessageSnapshots | None, error_log: ErrorLog) -> MutationCheck | None:
    return None if seen is None else MutationCheck(seen, error_log.error)
