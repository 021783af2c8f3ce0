"""A node whose implementation is an unmodified rclpy class, and the rclpy node of a behavior."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, cast

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from rclpy.node import Node as RosNode
from rclpy.parameter import Parameter as RosParameter

from composer.behavior import TransitionFailed
from composer.model import USE_SIM_TIME, BehaviorReference, HostedClass, Node, Port
from composer.model.interface_packages import how_to_get
from composer.runtime.callbacks.context import NodeContext
from composer.runtime.executors.futures import Cancelled
from composer.runtime.executors.strand import ExclusiveStrand, InlineStrand, Strand
from composer.runtime.executors.tracebacks import calls_user_code
from composer.runtime.hosting.adopted_node import AdoptedNode, adopted, is_managed
from composer.runtime.hosting.declared_ports import (
    DeclaredPorts,
    HostingError,
    action_names,
    remapping_arguments,
    report_undeclared,
)
from composer.runtime.hosting.dispatch import install
from composer.runtime.hosting.instance import (
    HostedLogger,
    Instance,
    InstanceSettings,
    SharedState,
    changed_parameters,
)
from composer.runtime.hosting.user_code import ThreadedCall, end_callbacks
from composer.runtime.node.behavior_loader import BehaviorLoadError, behavior_class, plain_name
from composer.runtime.node.local_node import LocalNode
from composer.runtime.node.managed_node import TransitionOutcome
from composer.runtime.node.node import Failed, WrongReturn
from composer.runtime.node.options import NodeOptions, make_ros_node
from composer.runtime.node.parameters import declare, ros_parameters
from composer.runtime.ports import PortSet

_THREAD_ENDS_WITHIN_S = 0.2
#: A constructor or a handler of a transition is reported once it has run for so long.
_BLOCKS_AFTER_S = 5.0
_STATE_IDS = {"unconfigured": 1, "inactive": 2, "active": 3, "finalized": 4}


class HostedNode(LocalNode):
    """Constructs the class when it is configured, and destroys the instance when it is cleaned up.

    The ROS node, with its parameter and lifecycle services, exists in all states.
    """

    _entities: PortSet

    def __init__(self, model: Node, options: NodeOptions) -> None:
        """Join the ROS graph, unconfigured. Raises ParameterError."""
        install()
        self._hosted = cast("HostedClass", model.hosted_class)
        super().__init__(model, options)
        self._entities = PortSet()
        self._instance: Instance | None = None
        #: The parameters as the model or the last instance has declared them, until the next one.
        self._declared: dict[str, RosParameter] = {}
        #: Parameters that were set at run time. They keep their values, as those of other nodes do.
        self._kept: dict[str, RosParameter] = {}
        self._overrides = ros_parameters((*model.parameters, *model.undeclared_parameters))
        simulated = self._overrides.pop(USE_SIM_TIME, None)
        if simulated is not None:
            self._ros.set_parameters([simulated])
        self._join()
        self._shared = SharedState(self._ros)
        self._declare_initial_parameters()

    @property
    def callback_owners(self) -> tuple[object, ...]:
        """The objects by which a running callback on a stack is recognized as the node's."""
        instance = self._instance
        return (*super().callback_owners, *(() if instance is None else instance.contexts))

    @property
    def instance(self) -> Any:
        """The instance of the class, or None."""
        return None if self._instance is None else self._instance.node

    # --- transitions

    def _make_ros_node(self) -> RosNode:
        return make_ros_node(self.model, remapping_arguments(self.model))

    def _make_strand(self) -> Strand:
        return ExclusiveStrand(self.loop)  # a callback may wait while the loop goes on

    def _context_of_transitions(self) -> NodeContext:
        # Not on the strand of the callbacks: one of them may wait for what a transition ends.
        return replace(self._context, strand=InlineStrand())

    async def _configure(self) -> None:
        self._context.group = self._always_on_context.group = MutuallyExclusiveCallbackGroup()
        self._keep_changed_parameters()
        instance = self._new_instance()
        self._instance, self._entities = instance, instance.entities
        await self._in_thread(instance, partial(self._construct, instance), "constructor")

    async def _call_user(self, transition: str) -> None:
        instance = self._instance
        if instance is None:
            return
        if is_managed(type(instance.node)):
            handle = partial(self._handle, instance, transition)
            await self._in_thread(instance, handle, f"on_{transition}")
        if transition == "configure":
            self._report_missing(instance.ports)
        if transition in ("cleanup", "shutdown"):
            await end_callbacks(instance)
            await self._in_thread(instance, partial(_end_as_by_signal, instance), "signal handler")
            await self._in_thread(instance, instance.node.destroy_node, "destroy_node")

    async def _call_user_on_error(self, _cause: BaseException) -> None:
        instance = self._instance
        if instance is not None and is_managed(type(instance.node)):
            await self._in_thread(instance, partial(self._handle, instance, "error"), "on_error")

    @calls_user_code
    def _handle(self, instance: Instance, transition: str) -> None:
        """Call a handler of a lifecycle node class."""
        name = f"on_{transition}"
        state = LifecycleState(self._start_state, _STATE_IDS.get(self._start_state, 0))
        answer = instance.instrumented(name, getattr(instance.node, name))(state)
        if answer == TransitionCallbackReturn.FAILURE:
            raise TransitionFailed(f"{name} returned FAILURE")
        if answer == TransitionCallbackReturn.ERROR:
            raise Failed(f"{name} returned ERROR")
        if answer != TransitionCallbackReturn.SUCCESS:
            raise WrongReturn(f"{name} returned {answer!r}, not a TransitionCallbackReturn")

    @calls_user_code
    def _construct(self, instance: Instance) -> None:
        target: Any = node_class(self._hosted.reference)
        arguments = {name.value: value for name, value in self._hosted.arguments}
        kind = adopted(target)
        node: Any = kind.__new__(kind, **arguments)
        node._composer_instance = instance
        instance.is_constructing = True
        try:
            node.__init__(**arguments)
        except SystemExit as error:
            raise HostingError(f"the constructor ends the process: SystemExit({error})") from error
        except ModuleNotFoundError as error:
            missing = plain_name(error.name or "")
            raise HostingError(f"{error}; {how_to_get(missing)}") from error
        finally:
            instance.end_construction()
        if instance.node is None:
            raise HostingError("the constructor does not call super().__init__()")

    def _discard(self, outcome: TransitionOutcome | None) -> None:
        instance, self._instance = self._instance, None
        self._entities = PortSet()
        if instance is None:
            return
        instance.end()
        for service in instance.lasting_services:
            self.loop.remove(service)
            self._context.router.withdraw(service)
            self._ros.destroy_service(service)
        has_failed = outcome is not None and outcome.transition == "configure"
        self._declared = instance.declared
        self._shared.remove_callbacks()
        if has_failed:
            # With values that it cannot be configured with, it would never be again.
            self._shared.restore()
            self._kept = {}
            self._declare_initial_parameters()
        self._check_threads(instance.threads)

    def _keep_changed_parameters(self) -> None:
        """Remove the parameters of the last instance; the next one begins with changed values."""
        self._kept |= changed_parameters(self._ros, self._declared)
        self._shared.restore()

    def _declare_initial_parameters(self) -> None:
        """Declare those with values in the model, which can be set before the class declares any.

        Raises ParameterError.
        """
        declared = {parameter.name.value: parameter for parameter in self.model.parameters}
        initial = [name for name in self._overrides if not self._ros.has_parameter(name)]
        for name in initial:
            if name in declared:
                declare(self._ros, declared[name])
            else:
                any_type = ParameterDescriptor(dynamic_typing=True)
                self._ros.declare_parameter(name, self._overrides[name].value, any_type)
        self._declared = {name: self._ros.get_parameter(name) for name in initial}

    # --- parts

    def _new_instance(self) -> Instance:
        logger_name = self._ros.get_logger().name
        return Instance(
            self.contexts,
            DeclaredPorts(self.model, partial(report_undeclared, self._context)),
            InstanceSettings(
                overrides=self._overrides | self._kept,
                logger=HostedLogger(self._context.log, logger_name),
                action_names=action_names(self.model),
                finish=self._finish,
                request=self._request,
                current_state=lambda: (_STATE_IDS.get(self.state, 0), self.state),
                may_block=True,
                package=self._hosted.reference.module.partition(".")[0],
            ),
        )

    async def _in_thread(self, instance: Instance, function: Callable[[], Any], name: str) -> None:
        """Call code of the class on a thread of its own, which may block within the time limit."""
        call = ThreadedCall(instance, function, f"{self.full_name} {name}")
        slow = self.loop.call_later(_BLOCKS_AFTER_S, partial(self._report_slow, call, name))
        instance.transition_thread = call.thread
        try:
            await call.result()
        except Cancelled:
            at = call.location
            self._context.log.error(f"{name} has not returned" + (f"; it is at {at}" if at else ""))
            raise
        finally:
            slow.cancel()
            instance.transition_thread = None

    def _report_slow(self, call: ThreadedCall, name: str) -> None:
        at = call.find_location()
        self._context.log.warn(f"{name} has not returned for {_BLOCKS_AFTER_S:g} s; it is at {at}")

    def _finish(self, reason: str) -> None:
        """Deactivate the node: in a process of its own, the class would have ended it."""
        if self._instance is not None and self._instance.in_transition:
            return
        self._context.log.warn(f"the node is deactivated: {reason}")
        self._request("deactivate")

    def _request(self, transition: str) -> None:
        self.loop.run_task(self.lifecycle.change(transition))

    def _report_missing(self, ports: DeclaredPorts) -> None:
        log = self._context.log
        for port in ports.missing():
            log.warn(f"the class has not created {port.kind} '{port.name}' on {port.full_name}")
        for difference in ports.differences:
            log.warn(f"QoS of the class counts: {difference}")
        declared: Any = self._ros._parameters
        unknown = sorted(self._overrides.keys() - declared.keys())
        for name in unknown:
            log.warn(f"the class has not declared parameter '{name}'")

    def _check_threads(self, threads: Sequence[threading.Thread]) -> None:
        """Report threads of the class that still run after its end."""
        for thread in threads:
            thread.join(_THREAD_ENDS_WITHIN_S / len(threads))
            if thread.is_alive():
                self._context.error_log.error(
                    "cleanup", f"thread '{thread.name}' of the class still runs"
                )


def _end_as_by_signal(instance: Instance) -> None:
    """Call the handler of the signal that would have ended the class in a process of its own."""
    handlers = instance.signal_handlers
    number = signal.SIGTERM if signal.SIGTERM in handlers else signal.SIGINT
    handler = handlers.get(number)
    if not callable(handler) or handler is signal.default_int_handler:
        return
    gate = instance.context.gate
    gate.outgoing = True  # for a last message, such as one that stops motors
    try:
        with suppress(SystemExit, KeyboardInterrupt):
            handler(number, None)
    finally:
        gate.outgoing = False


def missing_module(reference: BehaviorReference) -> str | None:
    """Import the class; return the name of a module that it or another one imports in vain."""
    install()
    try:
        node_class(reference)
    except ModuleNotFoundError as error:
        return plain_name(error.name or "")
    except (Exception, SystemExit):
        return None
    return None


def node_class(reference: BehaviorReference) -> type[RosNode]:
    """Import and return the class.

    Raises HostingError if there is none, and anything that importing its module raises.
    """
    try:
        found = behavior_class(reference)
    except BehaviorLoadError as error:
        raise HostingError(str(error).replace("behavior", "class", 1)) from error
    if not issubclass(found, RosNode):
        raise HostingError(
            f"class '{reference.text}' is not derived from rclpy's Node; a class without ROS is"
            " a 'behavior'"
        )
    return found


class NodeOfBehavior:
    """Adopts the ROS node of a behavior, from its configuration to its cleanup.

    What is created with it is gated by the lifecycle state. None of it is a declared port.
    """

    def __init__(self, owner: LocalNode, parameters: dict[str, RosParameter]) -> None:
        """``parameters`` were set at run time; those that are set now are added at the end."""
        install()
        self._parameters = parameters
        context, _ = owner.contexts
        self._shared = SharedState(context.node)
        self._instance = Instance(
            owner.contexts,
            DeclaredPorts(
                replace(owner.model, ports=()), partial(self._report, owner.model, context)
            ),
            InstanceSettings(
                overrides=dict(parameters),
                logger=HostedLogger(context.log, context.node.get_logger().name),
                action_names={},
                finish=lambda reason: context.error_log.error("node", reason),
                request=lambda transition: context.error_log.error("node", transition),
                current_state=lambda: (0, owner.state),
                may_block=False,
            ),
        )
        node: Any = AdoptedNode.__new__(AdoptedNode)
        node._composer_instance = self._instance
        AdoptedNode.__init__(node)
        self.node = node

    @staticmethod
    def _report(model: Node, context: NodeContext, port: Port) -> None:
        declared = model.ports_of(port.kind)
        if all(item.full_name != port.full_name for item in declared):
            report_undeclared(context, port)

    @property
    def entities(self) -> PortSet:
        """What was created with the node."""
        return self._instance.entities

    def end(self) -> None:
        """Release the node: its handle is not valid any more."""
        self._parameters.update(changed_parameters(self.node, self._instance.declared))
        self._instance.end()
        self._shared.restore()
