"""The generic lifecycle node: any node of any system, made from its model.

It builds its ports when it is configured, opens them when it is activated, and gives all of them
back when it is cleaned up, shut down or has failed.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any, TypeVar

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node as RosNode

from composer.behavior import TransitionFailed
from composer.model import BehaviorReference, Event, LogLevel, Node, PeriodError
from composer.runtime.callbacks.chains import Chains
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.log import ErrorLog, Log, Write, describe
from composer.runtime.callbacks.mutation_check import MutationCheck, SeenMessages
from composer.runtime.clock.clock import Clock
from composer.runtime.clock.sim_time import SimulatedTime
from composer.runtime.executors.event_counts import AnnouncedEvents
from composer.runtime.executors.loop import Loop
from composer.runtime.executors.strand import InlineStrand, SerialStrand
from composer.runtime.executors.tasks import Future
from composer.runtime.executors.user_code import calls_user_code
from composer.runtime.intra_process.lifecycle_gate import Gate
from composer.runtime.intra_process.pending import Pending
from composer.runtime.intra_process.router import Delivery
from composer.runtime.metrics.statistics import Statistics
from composer.runtime.node.behavior_loader import (
    Named,
    NodeClock,
    behavior_class,
    method,
    named_ports,
)
from composer.runtime.node.entities import Assembly
from composer.runtime.node.lifecycle import Lifecycle, Result
from composer.runtime.node.parameters import Parameters
from composer.runtime.node.ros_node import make_ros_node
from composer.runtime.ports.port import RunningPort

T = TypeVar("T")

_EVENTS = {
    "configure": Event.CONFIGURE,
    "activate": Event.ACTIVATE,
    "deactivate": Event.DEACTIVATE,
    "cleanup": Event.CLEANUP,
}


class WrongReturn(Exception):
    """A lifecycle handler returned something that says neither yes nor no."""


@dataclass(frozen=True, slots=True)
class Shared:
    """What serves all nodes of the process, on the loop of the manager."""

    simulated_time: SimulatedTime
    events: AnnouncedEvents


@dataclass(frozen=True, slots=True)
class NodeOptions:
    """How a node is run.

    ``delivery`` is where its ports meet those of the nodes beside it, ``chains`` are those of the
    system, ``shared`` is what there is once in the process;
    ``seen_messages`` is what all of them remember when changes of messages are looked for;
    ``parallel`` is true when its loop has several threads.
    """

    delivery: Delivery
    chains: Chains
    shared: Shared
    seen_messages: SeenMessages | None = None
    parallel: bool = False
    log_level: LogLevel = LogLevel.INFO
    transition_timeout_s: float = 10.0


@dataclass(frozen=True, slots=True)
class Listener:
    """Who is told what a node does.

    ``on_rest(transition, state, cause)``: a transition has ended, and ``cause`` is what went wrong
    with it, if anything did; ``on_fault(callback, text)``: user code failed; ``write_log(level,
    logger, message)``: a line for the log.
    """

    on_rest: Callable[[str, str, BaseException | None], None]
    on_fault: Callable[[str, str], None]
    write_log: Write


class RunningNode:
    """One node of a running system. To be created before its loop is started, or on it."""

    def __init__(
        self,
        model: Node,
        loop: Loop,
        options: NodeOptions,
        listener: Listener,
        statistics: Statistics | None = None,
    ) -> None:
        """Join the ROS graph, unconfigured; count on from ``statistics``. Raises ParameterError."""
        self.model = model
        self.loop = loop
        self.activations = 0  # how often it became active
        #: When, by ``time.monotonic()``, the work of its last transition began.
        self.turn_s = 0.0
        self.statistics = Statistics() if statistics is None else statistics
        self._listener = listener
        self._ros = make_ros_node(model)
        offers = model.introspection
        log = Log(self._ros, options.log_level, listener.write_log, rosout=offers.rosout)
        error_log = ErrorLog(log, self.statistics, listener.on_fault)
        self._core = NodeContext(
            node=self._ros,
            loop=loop,
            clock=Clock(self._ros, loop, options.shared.simulated_time, self._time_switched),
            gate=Gate(model.full_name, Pending(loop.call_later)),
            strand=SerialStrand(loop.call_soon) if options.parallel else InlineStrand(),
            log=log,
            error_log=error_log,
            statistics=self.statistics,
            names={"parameters": {}, "state": {}, "node": model.full_name},
            delivery=options.delivery,
            chains=options.chains.of(model),
            events=options.shared.events,
            mutations=_mutation_check(options.seen_messages, error_log),
        )
        # What is always on has a gate of its own and shares the rest.
        standby_gate = Gate(model.full_name, Pending(loop.call_later))
        self._standby = replace(self._core, gate=standby_gate)
        self._behavior: Any = None
        self._assembly = Assembly(self._core, self._standby)
        parameters = Parameters(
            self._ros, model.parameters, objection=self._objection, changed=self._changed
        )
        self._core.names["parameters"] = parameters.values
        self._keeps_entities = False
        loop.add_node(self._ros)
        self._lifecycle = Lifecycle(
            self._core,
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
        return self._lifecycle.state

    def now_s(self) -> float:
        """Return the node's time in seconds."""
        return self._core.now_s()

    def stand_still(self) -> None:
        """Let nothing through, from any thread: it has failed.

        It may say a last word in the next transition, and takes in what comes once that is over.
        """
        for core in self.cores:
            core.gate.hush()

    def give_up(self) -> None:
        """Tell who waits for a transition that it hangs, from any thread."""
        self._lifecycle.give_up()

    def sent(self, publisher: str) -> int:
        """Return how many messages went through a publisher."""
        return self.statistics.publisher(publisher).count

    @property
    def cores(self) -> tuple[NodeContext, NodeContext]:
        """What its parts share: those that stand still unless it is active, and the others."""
        return self._core, self._standby

    @property
    def legal(self) -> Mapping[str, int]:
        """The transitions that the state allows."""
        return self._lifecycle.legal

    async def change(self, transition: str) -> Result:
        """Make a transition when no other one is under way. Raises nothing."""
        return await self._lifecycle.change(transition)

    def ask(self, question: Callable[[RosNode], T]) -> Future[T]:
        """Return the answer to a question about the ROS node, which is put on its loop."""

        async def answer() -> T:
            return question(self._ros)

        return self.loop.run_task(answer())

    def keep_entities(self) -> None:
        """Keep ports when they are to be given back: the process ends, and they go with it."""
        self._keeps_entities = True

    def destroy(self) -> None:
        """Give back everything, whatever the state. No transition can be made afterwards."""
        self._release()
        self._lifecycle.destroy()
        self._core.clock.close()
        self.loop.remove_node(self._ros)
        self._ros.destroy_node()

    # --- what the lifecycle asks for

    async def on_transition(self, transition: str, start: str) -> None:
        """Do the work of ``transition``; raise what goes wrong."""
        self._take_turn()
        gate = self._core.gate
        gate.state = self._standby.gate.state = self.state
        gate.waiting = True
        if transition == "configure":
            self._configure()
            self._standby.gate.outgoing = True
        elif transition == "activate":
            gate.outgoing = True
        elif start == "active":
            await self._leave(self._core, self._assembly.gated)
        if transition in ("cleanup", "shutdown"):
            await self._leave(self._standby, self._assembly.always_on)
        await self._tell(transition)

    async def on_error(self, cause: BaseException) -> None:
        """Let the behaviour know why the node failed."""
        self._take_turn()
        await self._leave(self._core, self._assembly.gated)
        await self._leave(self._standby, self._assembly.always_on)
        self._core.gate.waiting = True
        await self._tell("error", cause)

    def on_rest(self, state: str, transition: str, cause: BaseException | None) -> None:
        """Open or shut everything as ``state`` wants it."""
        if state == "active" and transition == "activate":
            self.activations += 1
        _rest(self._core.gate, state, state == "active", self._assembly.gated)
        living = state in ("inactive", "active")
        _rest(self._standby.gate, state, living, self._assembly.always_on)
        if state in ("unconfigured", "finalized"):
            self._release()
        self._listener.on_rest(transition, state, cause)

    # --- transitions

    def _take_turn(self) -> None:
        self.turn_s = monotonic()
        for core in self.cores:
            core.gate.end_hush()

    def _configure(self) -> None:
        """Make the behaviour and the entities anew, so that nothing of an earlier life is left."""
        state = self._core.names["state"]
        state.clear()
        state.update({name.value: deepcopy(value) for name, value in self.model.state})
        # A callback group never forgets what was in it, so an old one is not used again.
        self._core.group = self._standby.group = MutuallyExclusiveCallbackGroup()
        self._assembly = Assembly(self._core, self._standby)
        reference = self.model.behavior
        behavior = None if reference is None else self._make_behavior(reference)
        try:
            self._assembly.build(self.model, behavior)
        finally:
            if behavior is not None:
                self._equip(behavior, self._assembly)
                self._behavior = behavior  # whole: nobody meets it without what was promised

    @calls_user_code
    def _make_behavior(self, reference: BehaviorReference) -> Any:
        return behavior_class(reference)()

    def _equip(self, behavior: Any, assembly: Assembly) -> None:
        behavior.name = self.full_name
        behavior.log = self._core.log
        behavior.clock = NodeClock(self._core, self._standby)
        behavior.parameters = Named("parameter", self._core.names["parameters"])
        behavior.publishers = named_ports("publisher", assembly.senders)
        behavior.clients = named_ports("client", assembly.clients)
        behavior.action_clients = named_ports("action client", assembly.action_clients)
        self._use(behavior, behavior.publishers, *assembly.senders.values())

    def _use(self, *used: object) -> None:
        self._core.used = self._standby.used = used

    async def _leave(self, core: NodeContext, ports: Iterable[RunningPort]) -> None:
        """Take nothing more in, end what is under way. Publishers stay open for a last word."""
        core.gate.incoming = False
        left = tuple(ports)
        for port in left:
            port.deactivate()
        core.gate.end_pending()
        for server in self._assembly.action_servers.values():
            if server in left:
                await server.drain()

    @calls_user_code
    async def _tell(self, transition: str, *arguments: Any) -> None:
        event = _EVENTS.get(transition)
        reaction = self._assembly.transitions.get(event) if event is not None else None
        if reaction is not None:
            reaction.run()
        name = f"on_{transition}"
        handler = method(self._behavior, name)
        if handler is None:
            return
        result = handler(*arguments)
        if isinstance(result, Awaitable):
            result = await result
        if self._core.mutations is not None:
            self._core.mutations.look(name)
        if result is None or result is True:
            return
        if result is False:
            raise TransitionFailed(f"{name} returned False")
        raise WrongReturn(f"{name} returned {result!r:.80}; None and True mean done, False refused")

    def _release(self) -> None:
        self._core.cancel_tasks()
        if self._keeps_entities:
            return
        for port in reversed(tuple(self._assembly.ports)):
            try:
                port.destroy()
            except Exception as error:
                self._core.log.error(f"cannot destroy {type(port).__name__}: {describe(error)}")
        self._assembly = Assembly(self._core, self._standby)
        self._behavior = None
        self._use()

    # --- parameters

    def _time_switched(self) -> None:
        self._core.strand.post(self._follow_clock)

    def _follow_clock(self) -> None:
        for timer in self._assembly.timers.values():
            timer.follow_clock()

    def _objection(self, values: Mapping[str, Any]) -> str | None:
        """Return why a timer could not go on with the new parameter values, or None."""
        for timer in self.model.timers:
            try:
                timer.period.seconds(values)
            except PeriodError as error:
                return f"timer '{timer.name}': {error}"
        return None

    def _changed(self, changes: Mapping[str, Any]) -> None:
        self._core.strand.post(lambda: self._follow_parameters(changes))

    def _follow_parameters(self, changes: Mapping[str, Any]) -> None:
        for timer in self._assembly.timers.values():
            timer.follow_parameters()
        handler = method(self._behavior, "on_parameters")
        if handler is not None:
            rest = self._core.call("on_parameters", handler, changes)
            if rest is not None:
                self._core.spawn(self._core.strand.wrap(rest))


def _rest(gate: Gate, state: str, is_open: bool, ports: Iterable[RunningPort]) -> None:
    """Let a gate, and the ports behind it, rest in ``state``."""
    gate.state = state
    if is_open:
        gate.open()
        for port in ports:
            port.activate()
        return
    for port in ports:
        port.deactivate()
    gate.close()


def _mutation_check(seen: SeenMessages | None, error_log: ErrorLog) -> MutationCheck | None:
    return None if seen is None else MutationCheck(seen, error_log.error)
