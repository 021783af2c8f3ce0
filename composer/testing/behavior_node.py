"""The node of a behavior in a test: its lifecycle and its ports, as the runtime has them."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import replace
from typing import Any, cast

from composer.behavior import BehaviorError, TransitionFailed
from composer.model import TF_TYPE, BehaviorReference, Node, Port, PortKind
from composer.model.lifecycle import ACTIVE, FINALIZED, INACTIVE, TRANSITIONS, UNCONFIGURED
from composer.runtime.executors.tasks import within
from composer.runtime.executors.tracebacks import describe, is_closing, shown, text_of
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate, PendingFutures
from composer.runtime.node.behavior_loader import (
    NodeClock,
    ParameterValues,
    behavior_class,
    method,
    named_ports,
)
from composer.runtime.ports import PortSet, RunningPort, deactivate, settle
from composer.runtime.ports.goals import Handlers
from composer.runtime.ports.timer import TimerPort
from composer.testing.behavior_context import TestContext
from composer.testing.behavior_ports import ClientPort, PublisherPort, ServicePort, SubscriptionPort
from composer.testing.failures import TestFailure
from composer.testing.goals import ActionServerPort
from composer.testing.message_classes import MessageClasses


class TestNode:
    """One life of a node with a behavior."""

    __test__ = False

    def __init__(self, model: Node, context: TestContext, messages: MessageClasses) -> None:
        self._model = model
        self._messages = messages
        self._context = context
        always_on_gate = LifecycleGate(model.full_name, PendingFutures(context.loop))
        self._always_on_context = replace(context, gate=always_on_gate)
        self._gates = (context.gate, always_on_gate)
        self._entities = PortSet()
        self._behavior: Any = None  # None once it was discarded after an error
        self.state = UNCONFIGURED
        #: The ports, by name; empty before *configure*.
        self.ports: dict[str, Any] = {}
        #: What answers the clients, by their names.
        self.servers: dict[str, ServicePort | ActionServerPort] = {}
        #: A :class:`.TestTransforms` if the node is configured and has transforms.
        self.transforms: Any = None
        #: The object of the behavior's class; None before *configure*.
        self.behavior: Any = None
        #: The reasons of ``self.fail(reason)``.
        self.failures: list[str] = []

    def set_server(self, client: str, server: ServicePort | ActionServerPort) -> None:
        """Let ``server`` answer a client from now on."""
        self.servers[client] = server
        if client in self.ports:
            self.ports[client].set_server(server)

    def on_parameters(self, changes: Mapping[str, Any]) -> None:
        """Follow a change of parameters."""
        for port in self._entities.ports:
            if isinstance(port, TimerPort):
                port.follow_parameters()
        handler = method(self._behavior, "on_parameters")
        rest = None if handler is None else self._context.call("on_parameters", handler, changes)
        if rest is not None:
            self._context.spawn(rest)

    async def change(self, transition: str) -> BaseException | None:
        """Run a transition that is possible; return what made it fail."""
        start = self.state
        end = TRANSITIONS[transition].goal
        self.state = TRANSITIONS[transition].during
        cause: BaseException | None = None
        try:
            await self._in_time(self._work(transition, start))
        except TransitionFailed as error:
            cause, end = error, start
            self._context.log.warn(f"on_{transition} refused the transition: {text_of(error)}")
        except BaseException as error:
            if is_closing(error):
                raise
            cause, end = error, await self._process_error(transition, error)
        self._enter(end)
        return cause

    async def _work(self, transition: str, start: str) -> None:
        gate, always_on_gate = self._gates
        gate.state = always_on_gate.state = self.state
        gate.waiting = True
        if transition == "configure":
            self._configure()
            always_on_gate.outgoing = True
        elif transition == "activate":
            gate.outgoing = True
            if self.transforms is not None:
                self.transforms.begin()
        elif start == ACTIVE:
            await deactivate(gate, self._entities.gated)
        if transition in ("cleanup", "shutdown"):
            await deactivate(always_on_gate, self._entities.always_on)
        await self._call_handler(f"on_{transition}")

    async def _process_error(self, transition: str, error: BaseException) -> str:
        """Let the behavior clean up after an error; return the state in which the node ends."""
        self._context.log.error(f"on_{transition}: {describe(error)}")
        self.state = "errorprocessing"

        async def work() -> None:
            await deactivate(self._gates[0], self._entities.gated)
            await deactivate(self._gates[1], self._entities.always_on)
            self._gates[0].waiting = True
            await self._call_handler("on_error", error)

        try:
            await self._in_time(work())
        except BaseException as second:
            if is_closing(second):
                raise
            self._context.log.error(f"on_error: {describe(second)}")
            return FINALIZED
        finally:
            self._behavior = None
        return UNCONFIGURED

    async def _in_time(self, work: Coroutine[Any, Any, None]) -> None:
        loop = self._context.loop
        limit_s = self._model.supervision.timeout_ms / 1000.0
        try:
            await within(loop, loop.run_task(work), limit_s)
        except TimeoutError:
            raise TestFailure(f"timed out after {limit_s:g} s") from None

    async def _call_handler(self, name: str, *arguments: Any) -> None:
        handler = method(self._behavior, name)
        if handler is None:
            return
        failures = len(self.failures)
        result = handler(*arguments)
        if isinstance(result, Awaitable):
            result = await result
        if len(self.failures) > failures:
            raise BehaviorError(f"the node has failed: {self.failures[failures]}")
        if result is False:
            raise TransitionFailed(f"{name} returned False")
        if result is not None and result is not True:
            text = f"{name} returned {shown(result)}; None and True mean done, False refused"
            raise TypeError(text)

    def _enter(self, state: str) -> None:
        """Open or close the gates for a primary state."""
        self.state = state
        self._context.note(f"the node is {state}")
        is_configured = state in (INACTIVE, ACTIVE)
        settle(self._gates[0], state, state == ACTIVE, self._entities.gated)
        settle(self._gates[1], state, is_configured, self._entities.always_on)
        if not is_configured:
            self._context.cancel_tasks()
            for port in self._entities.ports:
                port.destroy()
            self._entities = PortSet()
            self.ports, self.transforms = {}, None

    # --- configure

    def _configure(self) -> None:
        behavior = behavior_class(cast(BehaviorReference, self._model.behavior))()
        if self._model.transforms is not None:
            self.transforms = self._make_transforms()
            self._entities.add(self.transforms, self.transforms)
        for port in self._model.ports:
            self._add(port.name.value, port, self._make_port(port, behavior))
        for timer in self._model.timers:
            handler = method(behavior, f"on_{timer.name.value}")
            context = cast(Any, self._context_of(timer))
            self._add(f"timer {timer.name}", timer, TimerPort(context, timer, None, handler))
        behavior.name = self._model.full_name
        behavior.log = self._context.log
        behavior.clock = NodeClock(cast(Any, self._context), cast(Any, self._always_on_context))
        behavior.parameters = ParameterValues(self._context.names["parameters"])
        behavior.publishers = self._named(PortKind.PUBLISHER)
        behavior.clients = self._named(PortKind.CLIENT)
        behavior.action_clients = self._named(PortKind.ACTION_CLIENT)
        if self.transforms is not None:
            behavior.transforms = self.transforms
        if not hasattr(behavior, "fail"):
            behavior.fail = self._fail
        if not hasattr(behavior, "node"):
            behavior.node = _NoRosNode()
        self._behavior = self.behavior = behavior

    def _add(self, name: str, declared: Any, port: RunningPort) -> None:
        self._entities.add(declared, port, always_on=declared.always_on)
        self.ports[name] = port

    def _named(self, kind: PortKind) -> Any:
        ports = [port.name.value for port in self._model.ports_of(kind)]
        return named_ports(kind.value, {name: self.ports[name] for name in ports})

    def _make_port(self, port: Port, behavior: Any) -> RunningPort:
        context, name = self._context_of(port), port.name.value
        interface = self._messages.interface(port.interface.value)
        handler: Any = method(behavior, f"on_{name}")
        match port.kind:
            case PortKind.PUBLISHER:
                return PublisherPort(context, name, interface)
            case PortKind.SUBSCRIPTION:
                return SubscriptionPort(context, port, self._on_message(port, handler))
            case PortKind.SERVICE:
                return ServicePort(context, port, interface, handler)
            case PortKind.ACTION_SERVER:
                handlers = Handlers(handler, method(behavior, f"accept_{name}"))
                return ActionServerPort(context, port, interface, handlers)
            case _:
                client = ClientPort(context, port, interface)
                if name in self.servers:
                    client.set_server(self.servers[name])
                return client

    def _on_message(self, port: Port, handler: Any) -> Callable[[Any], Any]:
        broadcasts: list[Any] = []
        if self.transforms is not None:
            broadcasts += self.transforms.broadcaster.from_messages(port)

        def handle(message: Any) -> Coroutine[Any, Any, None] | None:
            for broadcast in broadcasts:
                broadcast.run(message)
            if handler is None:
                return None
            return self._context.call(f"on_{port.name}", handler, message)

        return handle

    def _make_transforms(self) -> Any:
        from composer.testing.behavior_transforms import TestTransforms

        message_type = self._messages.interface(TF_TYPE)
        return TestTransforms(self._context, cast(Any, self._model.transforms), message_type)

    def _context_of(self, declared: Any) -> TestContext:
        return self._always_on_context if declared.always_on else self._context

    def _fail(self, reason: str) -> None:
        self.failures.append(str(reason))
        self._context.note(f"the node has failed: {reason}")


class _NoRosNode:
    """``node`` of a behavior: there is none."""

    def __getattr__(self, name: str) -> Any:
        raise TestFailure(f"'self.node.{name}' needs a running node: test it with SystemTest")
