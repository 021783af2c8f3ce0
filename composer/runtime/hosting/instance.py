"""One instance of a hosted class, from the configuration of its node to the cleanup; its logger."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import count
from math import inf
from types import FrameType
from typing import Any

from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.executors import Executor
from rclpy.impl import rcutils_logger
from rclpy.impl.logging_severity import LoggingSeverity
from rclpy.impl.rcutils_logger import CallerId, RcutilsLogger
from rclpy.parameter import Parameter
from rclpy.service import Service

from composer.base.fast_dataclass import dataclass
from composer.model import SEVERITIES, LogLevel, Port, PortKind
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.callbacks.log import Log
from composer.runtime.executors.futures import Awaited, Future, done_event
from composer.runtime.executors.strand import ExclusiveStrand, ReentrantStrand, Strand
from composer.runtime.executors.tasks import name_of
from composer.runtime.hosting.declared_ports import DeclaredPorts
from composer.runtime.hosting.user_code import InstanceExecutor, PermittedFunction, UserFunction
from composer.runtime.intra_process.lifecycle_gate import LifecycleGate
from composer.runtime.ports import PortSet, RunningPort

_LEVELS = {severity: level for level, severity in SEVERITIES.items()}
#: How long ``rclpy.spin_once`` without a time waits: responses of clients do not end it.
_SPINS_WITHIN_S = 0.05
#: rclpy does not notify when a server appears.
_POLL_PERIOD_S = 0.05
#: The groups of rclpy. Classes derived from them are groups of a class's own.
_GROUPS = (MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup)
_CALLBACKS = (
    "_pre_set_parameters_callbacks",
    "_on_set_parameters_callbacks",
    "_post_set_parameters_callbacks",
)
_SHARED = ("_parameters", "_descriptors", *_CALLBACKS)


class HostedLogger(RcutilsLogger):
    """What ``get_logger`` returns."""

    def __init__(self, log: Log, name: str) -> None:
        super().__init__(name)
        self._log = log

    def get_child(self, name: str) -> RcutilsLogger:
        """Return the logger ``<this name>.<name>``, which has the level of this one."""
        if not name:
            raise ValueError("Child logger name must not be empty.")
        child = object.__new__(HostedLogger)
        RcutilsLogger.__init__(child, f"{self.name}.{name}")
        child._log = self._log
        return child

    def log(self, message: str, severity: Any, **options: Any) -> bool:
        """Log a message; return false if its level or one of rclpy's filters suppresses it."""
        if not self.is_enabled_for(severity):
            return False
        severity = LoggingSeverity(severity)
        name = options.pop("name", self.name)
        if options and not self._passes(options):
            return False
        level = _LEVELS.get(int(severity), LogLevel.INFO)
        # Not by rclpy's _find_caller, which reads the source file each time.
        caller: FrameType | None = sys._getframe(1)
        while caller is not None and caller.f_code.co_filename == rcutils_logger.__file__:
            caller = caller.f_back
        self._log.emit(level, str(message), name, caller)
        return True

    def _passes(self, options: dict[str, Any]) -> bool:
        """Apply the filters of a call, each of which has a memory for each place in the code."""
        names = rcutils_logger.get_filters_from_kwargs(**options)
        filters = rcutils_logger.supported_filters
        caller = CallerId(rcutils_logger._find_caller(sys._getframe(2)))
        if caller not in self.contexts:
            memory: dict[str, Any] = {}
            for name in names:
                filters[name].initialize_context(memory, **options)
            self.contexts[caller] = memory
        return all(filters[name].should_log(self.contexts[caller]) for name in names)


@dataclass(frozen=True, slots=True)
class InstanceSettings:
    """What an instance gets from its node.

    ``overrides`` are the initial values of parameters, by name. ``action_names`` are the full names
    of actions by kind and expanded name. ``finish(reason)`` deactivates the node: the class says
    that it has finished. ``request(transition)`` requests a transition. ``current_state()`` returns
    the id and the label of the state. With ``may_block``, others run while a callback blocks: those
    of its group wait on a strand. ``package`` is the top-level package of the class; empty for the
    node of a behavior.
    """

    overrides: Mapping[str, Parameter]
    logger: HostedLogger
    action_names: Mapping[tuple[PortKind, str], str]
    finish: Callable[[str], None]
    request: Callable[[str], None]
    current_state: Callable[[], tuple[int, str]]
    may_block: bool
    package: str = ""


def is_reentrant(context: NodeContext) -> bool:
    """Return whether the callbacks of a callback group, by its context, may overlap."""
    return type(context.group) is ReentrantCallbackGroup


class Instance:
    """What the entities of one instance share."""

    def __init__(
        self,
        contexts: tuple[NodeContext, NodeContext],
        ports: DeclaredPorts,
        settings: InstanceSettings,
    ) -> None:
        """``contexts`` are the node's, gated by *active* and always on."""
        self.context, self._always_on_context = contexts
        loop = self.context.loop
        #: Begin and end a call of a callback.
        self.begin_blocking = loop.begin_blocking if settings.may_block else _ignore
        self.end_blocking = loop.end_blocking
        #: Done at the end of the next callback, if ``rclpy.spin_once`` waits for it.
        self.spun: Future[None] | None = None
        #: Set when the instance has been destroyed.
        self.ended = threading.Event()
        #: The callbacks that were interrupted, with the identifiers of their threads.
        self.interrupted: set[tuple[int, str]] = set()
        #: The threads that the class has started.
        self.threads: list[threading.Thread] = []
        self.ports = ports
        self.settings = settings
        self.entities = PortSet()
        #: The instance, once ``Node.__init__`` was called.
        self.node: Any = None
        #: What the class calls when its process is interrupted or terminated, by signal.
        self.signal_handlers: dict[int, Any] = {}
        #: True while the constructor runs.
        self.is_constructing = False
        #: The gates as they were before the constructor has spun.
        self._gates: list[tuple[LifecycleGate, bool, bool]] = []
        #: The parameters as they were declared.
        self.declared: dict[str, Parameter] = {}
        #: ``self.executor`` of the class.
        self.executor = InstanceExecutor(self)
        #: The executors of the class's own that the node was added to.
        self.executors: list[Executor] = []
        #: Services of the ROS node that exist as long as the instance.
        self.lasting_services: list[Service] = []
        #: The thread of the constructor or of the current handler of a transition.
        self.transition_thread: threading.Thread | None = None
        self._contexts: dict[CallbackGroup, NodeContext] = {}
        #: The names of the timers that exist now: counters are kept by name.
        self.timer_names: set[str] = set()

    @property
    def in_transition(self) -> bool:
        """Whether the constructor or a handler of a transition runs."""
        return self.transition_thread is not None

    @property
    def contexts(self) -> tuple[NodeContext, ...]:
        """The contexts of all callback groups."""
        return tuple(self._contexts.values())

    def context_of(self, port: Port, entity: Any) -> NodeContext:
        """Return the context of the port of an entity of rclpy."""
        context = self.context_for(getattr(entity, "callback_group", None))
        return replace(context, gate=self._always_on_context.gate) if port.always_on else context

    def context_for(self, group: CallbackGroup | None) -> NodeContext:
        """Return the context of the entities in a callback group, which decides what overlaps.

        A group that the class has defined is asked for each callback, see :meth:`function`.
        """
        if group is None or group is self.node.default_callback_group:
            return self.context
        if group not in self._contexts:
            is_exclusive = type(group) is MutuallyExclusiveCallbackGroup
            strand: Strand = (ExclusiveStrand if is_exclusive else ReentrantStrand)(
                self.context.loop
            )
            self._contexts[group] = replace(self.context, strand=strand, group=group)
        return self._contexts[group]

    def function(self, callback: Any, entity: Any, context: NodeContext) -> UserFunction:
        """Return a callback of an entity, as its callback group permits it."""
        group = context.group
        if type(group) in _GROUPS:
            return UserFunction(self, callback)
        return PermittedFunction(self, callback, context, group, entity)

    def timer_name(self, callback: object) -> str:
        """Return a name for a timer that has none: the name of its callback."""
        name = "rate" if callback is None else name_of(callback).rpartition(".")[2]
        names = (name if number == 1 else f"{name}_{number}" for number in count(1))
        free = next(name for name in names if name not in self.timer_names)
        self.timer_names.add(free)
        return free

    def begin(self, entity: object, port: RunningPort, *, always_on: bool = False) -> None:
        """Add the port of an entity, and activate it if the node is active."""
        self.entities.add(entity, port, always_on=always_on)
        gate = self._always_on_context.gate if always_on else self.context.gate
        if gate.incoming:
            port.activate()

    def remove(self, entity: object) -> bool:
        """Destroy an entity with its port; return false if it has none."""
        port = self.pop(entity)
        if port is not None:
            port.destroy()
        return port is not None

    def pop(self, entity: object) -> RunningPort | None:
        """Remove and return the port of an entity, or None; the class may create it again."""
        port = self.entities.pop(entity)
        declared = getattr(port, "port", None)
        if declared is not None:
            self.ports.forget(declared)
        return port

    def end(self) -> None:
        """Let threads that spin the node return, and release its executors."""
        self.ended.set()
        for executor in self.executors:
            executor.shutdown(0.0)

    def spin(self, future: Awaited, timeout_s: float | None) -> None:
        """Wait as :meth:`wait_for`, for a function of rclpy that spins.

        From the first spin in the constructor to its end, callbacks run as if the node were active.
        """
        is_constructor = threading.current_thread() is self.transition_thread
        if self.is_constructing and is_constructor and not self._gates:
            for context in (self.context, self._always_on_context):
                gate = context.gate
                self._gates.append((gate, gate.incoming, gate.outgoing))
                gate.incoming = gate.outgoing = True
            for port in self.entities.ports:
                port.activate()
        self.wait_for(future, timeout_s)

    def spin_once(self, timeout_s: float | None) -> None:
        """Spin until a callback has ended."""
        self.spun = Future()
        self.spin(self.spun, _SPINS_WITHIN_S if timeout_s is None else timeout_s)
        self.spun = None

    def end_construction(self) -> None:
        """Close the gates again if the constructor has spun."""
        self.is_constructing = False
        gates, self._gates = self._gates, []
        for gate, incoming, outgoing in gates:
            gate.incoming, gate.outgoing = incoming, outgoing
        if gates:
            for port in self.entities.ports:
                port.deactivate()

    def instrumented(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a callback of the class, with the faults of a test if there is one."""
        instruments = self.context.instruments
        if instruments is None:
            return function
        return instruments.callback(self.context.names["node"], name, function)

    def wait(self, event: threading.Event, timeout_s: float | None = None) -> bool:
        """Block until ``event`` is set, in code of the class; return false after the time.

        In a callback, the loop goes on. Raises CallAbandoned if the call is interrupted.
        """
        self.context.loop.wait(event, timeout_s)
        return event.is_set()

    def wait_for(self, future: Awaited, timeout_s: float | None) -> bool:
        """Block until ``future`` is done, in code of the class; return false after the time.

        In a callback, the loop goes on with everything but callbacks of the same group.
        """
        self.wait(done_event(future), None if timeout_s is None or timeout_s < 0 else timeout_s)
        return future.done()

    def sleep(self, delay_s: float) -> None:
        """Block for a time by the clock of the loop, as :meth:`wait_for`."""
        self.wait(threading.Event(), max(0.0, delay_s))

    def wait_for_server(self, is_ready: Callable[[], bool], timeout_s: float | None) -> bool:
        """Block until ``is_ready()``, as rclpy does by polling; return false after the time."""
        monotonic = self.context.loop.clock.monotonic
        until_s = inf if timeout_s is None else monotonic() + timeout_s
        while not is_ready() and monotonic() < until_s and not self.ended.is_set():
            self.sleep(min(_POLL_PERIOD_S, until_s - monotonic()))
        return is_ready()


def _ignore(*, expected: bool) -> None:
    """Do not watch a call."""


def changed_parameters(node: Any, declared: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Return the parameters of a node whose values were set after they were ``declared``."""
    present = node._parameters
    return {
        name: present[name]
        for name, parameter in declared.items()
        if name in present and present[name] is not parameter
    }


class SharedState:
    """Removes the parameters and callbacks that were added since it was created."""

    def __init__(self, node: Any) -> None:
        self._before = {name: (shared := getattr(node, name), shared.copy()) for name in _SHARED}

    def restore(self) -> None:
        """Remove what was added; what was there before keeps its present value."""
        self._remove(_SHARED)

    def remove_callbacks(self) -> None:
        """Remove the callbacks that were added, but no parameters."""
        self._remove(_CALLBACKS)

    def _remove(self, names: Iterable[str]) -> None:
        for shared, before in map(self._before.__getitem__, names):
            if isinstance(shared, dict):
                for name in shared.keys() - before.keys():
                    del shared[name]
            else:
                shared[:] = [item for item in shared if item in before]
