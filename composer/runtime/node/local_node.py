"""What every node of this process has: a ROS node, a lifecycle, gates, a log, and counters.

The kinds of nodes differ in what they create and call in a transition. See
:class:`~composer.runtime.node.node.RunningNode` and
:class:`~composer.runtime.hosting.hosted_node.HostedNode`.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from rclpy.node import Node as RosNode

from composer.model import Node
from composer.model.lifecycle import FINALIZED
from composer.plan import FaultKind
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.log import ErrorLimit, ErrorLog, Log
from composer.runtime.callbacks.observers import MutationCheck
from composer.runtime.executors.sources import rclpy_callback
from composer.runtime.executors.strand import InlineStrand, SerialStrand, Strand
from composer.runtime.executors.tracebacks import describe
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate, PendingFutures
from composer.runtime.node.lifecycle import Lifecycle
from composer.runtime.node.managed_node import ManagedNode, TransitionOutcome
from composer.runtime.node.options import NodeOptions, make_ros_node, record_parameter_events
from composer.runtime.node.parameter_services import ParameterServices, provide_logger_services
from composer.runtime.node_time import NodeTime
from composer.runtime.ports import PortSet, deactivate, settle


class LibraryNode(Protocol):
    """An rclpy node for the libraries that a behavior uses: what they create follows the node."""

    @property
    def node(self) -> Any:
        """The rclpy node."""

    @property
    def entities(self) -> PortSet:
        """What was created with it."""

    def end(self) -> None:
        """Release it, once its entities are destroyed."""


class LocalNode(ManagedNode):
    """A :class:`.ManagedNode` of this process.

    Create it before its loop is started, or on the loop.

    A subclass calls :meth:`_join` at the end of its constructor. ``_entities`` are what the node
    has from configure to cleanup.
    """

    _entities: PortSet
    lifecycle: Lifecycle

    def __init__(self, model: Node, options: NodeOptions) -> None:
        super().__init__(model, options)
        loop, listener = options.loop, options.listener
        self._start_state = ""  # of the current transition
        recorder = options.router.recorder
        self._ros = self._make_ros_node()
        offers = model.introspection
        log = Log(self._ros, listener.write_log, rosout=offers.rosout, recorder=recorder)
        self._error_limit = _error_limit(model, options)
        error_log = ErrorLog(log, loop.clock, self.statistics, listener.on_error, self._error_limit)
        seen = options.seen_messages
        self._context = NodeContext(
            node=self._ros,
            loop=loop,
            clock=NodeTime(self._ros, loop, options.process.simulated_time, self._time_switched),
            gate=LifecycleGate(model.full_name, PendingFutures(loop)),
            strand=self._make_strand(),
            log=log,
            error_log=error_log,
            statistics=self.statistics,
            names={"parameters": {}, "state": {}, "node": model.full_name},
            router=options.router,
            chains=options.chains.of(model),
            events=options.process.events,
            mutations=None if seen is None else MutationCheck(seen, error_log.error),
            instruments=options.instruments,
        )
        record_parameter_events(self._ros, recorder)  # with stamps of the clock that it has now
        # Ports that are always on have a gate of their own and share the rest.
        always_on_gate = LifecycleGate(model.full_name, PendingFutures(loop))
        self._always_on_context = replace(self._context, gate=always_on_gate)

    def _join(self) -> None:
        """Join the ROS graph, unconfigured; the parameters are declared."""
        offers = self.model.introspection
        self.parameter_services = ParameterServices(
            self._ros, self.loop.clock, self._context.log.warn
        )
        if offers.parameters:
            self.parameter_services.provide()
        if offers.logger_services:
            provide_logger_services(self._ros, self.loop.clock, self._context.log.warn)
        self.loop.add_node(self._ros)
        for service in self._ros.services:
            answer = rclpy_callback(service, self.loop.run_task)
            self._context.router.offer(service, self.loop.call_soon, answer)
        self.lifecycle = Lifecycle(
            self._context_of_transitions(),
            self,
            timeout_s=self._timeout_s,
            services=offers.lifecycle_services,
        )

    def now_s(self) -> float:
        """Return the node's time in seconds."""
        return self._context.now_s()

    def block(self) -> None:
        """Block all ports of a failed node until its next transition. Thread-safe.

        In that transition the node can send last messages; it receives again after it.
        """
        if self._error_limit is not None:
            self._error_limit.paused = True  # it has failed already
        for context in self.contexts:
            context.gate.block()

    def fail(self, reason: str) -> None:
        """Report that the node has failed."""
        self._listener.on_fault(FaultKind.REPORTED, reason)

    @property
    def callback_owners(self) -> tuple[object, ...]:
        """The objects by which a running callback on a stack is recognized as the node's."""
        return (self, *self.contexts)

    @property
    def contexts(self) -> tuple[NodeContext, NodeContext]:
        """What its parts share: those that are gated by *active*, and those that are always on."""
        return self._context, self._always_on_context

    def destroy(self) -> None:
        """Destroy the node in any state. No transition is possible afterwards."""
        self._release()
        for service in self._ros.services:
            self._context.router.withdraw(service)
        self.lifecycle.destroy()
        self._context.clock.close()
        self.loop.remove_node(self._ros)
        self._ros.destroy_node()

    # --- what the kinds of nodes do

    def _make_ros_node(self) -> RosNode:
        return make_ros_node(self.model)

    def _make_strand(self) -> Strand:
        """Return what keeps callbacks apart where the loop does not."""
        return SerialStrand(self.loop) if self.loop.is_parallel else InlineStrand()

    def _context_of_transitions(self) -> NodeContext:
        """Return the context whose strand runs transitions."""
        return self._context

    @abstractmethod
    async def _configure(self) -> None:
        """Create new entities, so that nothing of an earlier life remains."""

    @abstractmethod
    async def _call_user(self, transition: str) -> None:
        """Call the user's handler of a transition."""

    @abstractmethod
    async def _call_user_on_error(self, cause: BaseException) -> None:
        """Call the user's handler of errors."""

    @abstractmethod
    def _discard(self, outcome: TransitionOutcome | None) -> None:
        """Release what is left after the entities were destroyed; without an outcome, forever."""

    def _time_switched(self) -> None:
        """Follow the node's switch to or from simulated time."""
        self._context.strand.post(self._follow_clock)

    def _follow_clock(self) -> None:
        for port in self._entities.ports:
            port.follow_clock()

    # --- hooks of the lifecycle

    async def on_transition(self, transition: str, start: str) -> None:
        """Do the work of ``transition``; raise what goes wrong."""
        self._begin_transition()
        self._start_state = start
        gate = self._context.gate
        gate.state = self._always_on_context.gate.state = self.state
        gate.waiting = True
        if transition == "configure":
            await self._configure()
            self._always_on_context.gate.outgoing = True
        elif transition == "activate":
            gate.outgoing = True
        elif start == "active":
            await deactivate(self._context.gate, self._entities.gated)
        if transition in ("cleanup", "shutdown"):
            await deactivate(self._always_on_context.gate, self._entities.always_on)
        await self._call_user(transition)

    async def on_error(self, cause: BaseException) -> None:
        """Let the user's code clean up. What it raises finalizes the node."""
        self._begin_transition()
        await deactivate(self._context.gate, self._entities.gated)
        await deactivate(self._always_on_context.gate, self._entities.always_on)
        self._context.gate.waiting = True
        await self._call_user_on_error(cause)

    def on_transition_end(self, result: TransitionOutcome) -> None:
        """Open or close the gates for the new state, and report it."""
        state = result.state
        if state == "active":
            is_activation = result.transition == "activate"
            self.activations += is_activation
            self._resume_error_limit(restart=is_activation)
        settle(self._context.gate, state, state == "active", self._entities.gated)
        is_configured = state in ("inactive", "active")
        settle(self._always_on_context.gate, state, is_configured, self._entities.always_on)
        if state in ("unconfigured", FINALIZED):
            self._release(result)
        self._listener.on_transition_end(result)

    # --- transitions

    def _begin_transition(self) -> None:
        self.transition_started_s = self.loop.clock.monotonic()
        if self._error_limit is not None:
            self._error_limit.paused = True
        for context in self.contexts:
            context.gate.unblock_outgoing()

    def _resume_error_limit(self, *, restart: bool) -> None:
        if self._error_limit is None:
            return
        if restart:
            self._error_limit.start()
        else:  # a refused transition
            self._error_limit.paused = False

    def _release(self, outcome: TransitionOutcome | None = None) -> None:
        self._context.cancel_tasks()
        if self._run_state.keeps_entities:
            return
        for port in reversed(tuple(self._entities.ports)):
            try:
                port.destroy()
            except Exception as error:
                self._context.log.error(f"cannot destroy {type(port).__name__}: {describe(error)}")
        self._discard(outcome)


def _error_limit(model: Node, options: NodeOptions) -> ErrorLimit | None:
    supervision = model.supervision
    max_errors = supervision.watch.max_errors
    if max_errors is None:
        return None
    window_s = supervision.restart.window_ms / 1000.0
    report = partial(options.listener.on_fault, FaultKind.ERRORS)
    return ErrorLimit(max_errors.value, window_s, report, lambda: options.run_state.is_up)
