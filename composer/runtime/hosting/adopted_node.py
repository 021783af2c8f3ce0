"""The base classes between a hosted class and rclpy's Node and LifecycleNode.

Everything here depends on rclpy's internals (rclpy 7.1, ROS 2 Jazzy).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partialmethod
from typing import Any, TypeVar

from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.callback_groups import CallbackGroup, MutuallyExclusiveCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.lifecycle.publisher import LifecyclePublisher
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.service import Service
from rclpy.subscription import Subscription
from rclpy.timer import Rate, Timer
from rclpy.waitable import Waitable

from composer.model import PortKind
from composer.runtime.executors.sources import Taken, rclpy_callback
from composer.runtime.hosting.declared_ports import HostingError
from composer.runtime.hosting.instance import Instance
from composer.runtime.hosting.ports.actions import HostedActionClient, HostedActionServer
from composer.runtime.hosting.ports.qos_events import PendingQosEvents
from composer.runtime.hosting.ports.services import ClientPort, HostedService
from composer.runtime.hosting.ports.timers import HostedGuardCondition, HostedRate, HostedTimerPort
from composer.runtime.hosting.ports.topics import FirstMessage, HostedPublisher, HostedSubscription
from composer.runtime.node.parameter_services import provide_logger_services
from composer.runtime.ros.messages import load_type_support

T = TypeVar("T")

#: Arguments of ``Node.__init__`` that have no effect on a hosted node or are taken over.
_REFUSED = {
    "context": "a context of its own; a hosted node joins the context of the system",
    "cli_args": "command-line arguments of its own; use 'remappings' and 'parameters' in YAML",
}
#: The lists of rclpy's entities, each instance has its own.
_LISTS = ("_publishers", "_subscriptions", "_clients", "_services", "_timers", "_guards")


class AdoptedNode(Node):
    """Joins the ROS node that exists in all states, instead of creating one.

    The type decides, not a scope that is switched on and off: so threads do not matter.
    """

    _composer_instance: Instance

    def __init__(self, _node_name: Any = None, **options: Any) -> None:
        instance = self._composer_instance
        if instance.node is not None:
            raise HostingError("the class calls Node.__init__ twice")
        for name, what in _REFUSED.items():
            if options.get(name) is not None:
                raise HostingError(f"the class has {what}")
        lasting: Any = instance.context.node
        vars(self).update(vars(lasting))
        for name in _LISTS:
            setattr(self, name, [])
        self._Node__waitables: list[Waitable] = []
        self._default_callback_group = MutuallyExclusiveCallbackGroup()
        self._logger = instance.settings.logger
        overrides = {item.name: item for item in options.get("parameter_overrides") or ()}
        self._parameter_overrides = {**overrides, **instance.settings.overrides}
        may_be_undeclared = bool(options.get("allow_undeclared_parameters"))
        self._allow_undeclared_parameters = may_be_undeclared
        lasting._allow_undeclared_parameters = may_be_undeclared
        instance.node = self
        if options.get("automatically_declare_parameters_from_overrides"):
            for parameter in self._parameter_overrides.values():
                if not self.has_parameter(parameter.name):
                    self.declare_parameter(parameter.name, parameter.value)
        is_offered = instance.ports.node.introspection.logger_services
        if options.get("enable_logger_service") and not is_offered:
            self._add_logger_services(lasting)

    def _declare_parameter_common(self, parameter_list: Any, descriptors: Any = None) -> Any:
        results = super()._declare_parameter_common(parameter_list, descriptors)
        for parameter in parameter_list:
            self._composer_instance.declared[parameter.name] = parameter
        return results

    def _add_logger_services(self, lasting: Any) -> None:
        """Let other nodes change the level of the logger, in every state."""
        instance = self._composer_instance
        context = instance.context
        before = len(lasting._services)
        provide_logger_services(lasting, context.loop.clock, context.log.warn)
        for service in lasting._services[before:]:
            context.serve(service, rclpy_callback(service, context.loop.run_task))
            instance.lasting_services.append(service)

    # --- what all instances of a node share

    @property  # type: ignore[misc]  # rclpy's setter only raises
    def handle(self) -> Any:
        """The ROS node. Raises InvalidHandle once the instance has ended."""
        if self._composer_instance.ended.is_set():
            raise InvalidHandle("the node was cleaned up")
        return self._Node__node  # type: ignore[attr-defined]

    @property
    def executor(self) -> Any:
        """What runs the node's callbacks."""
        return self._composer_instance.executor

    @executor.setter
    def executor(self, _: Any) -> None:
        """Do nothing: the composer runs the callbacks."""

    def destroy_node(self) -> None:
        """Destroy the entities of the instance; by the class itself, it ends the node's activity.

        The ROS node remains for the next instance.
        """
        instance = self._composer_instance
        if not (instance.in_transition or instance.ended.is_set()):
            instance.settings.finish("it called destroy_node()")

    # --- entities

    def create_publisher(
        self,
        msg_type: Any,
        topic: str,
        qos_profile: Any,
        *,
        event_callbacks: Any = None,
        publisher_class: type[Publisher] = Publisher,
        **options: Any,
    ) -> Publisher:
        """Create a publisher, as rclpy."""
        load_type_support(msg_type)
        events = PendingQosEvents(event_callbacks)
        publisher = super().create_publisher(
            msg_type,
            topic,
            qos_profile,
            event_callbacks=events,  # type: ignore[arg-type]
            publisher_class=publisher_class,
            **options,
        )
        return self._begun(publisher, HostedPublisher, events)

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Any,
        qos_profile: Any,
        *,
        event_callbacks: Any = None,
        **options: Any,
    ) -> Subscription:
        """Create a subscription, as rclpy."""
        load_type_support(msg_type)
        events = PendingQosEvents(event_callbacks)
        subscription = super().create_subscription(
            msg_type,
            topic,
            callback,
            qos_profile,
            event_callbacks=events,  # type: ignore[arg-type]
            **options,
        )
        return self._begun(subscription, HostedSubscription, events)

    def create_service(self, srv_type: Any, *arguments: Any, **options: Any) -> Service:
        """Create a service, as rclpy."""
        load_type_support(srv_type)
        service = super().create_service(srv_type, *arguments, **options)
        return self._begun(service, HostedService)

    def create_client(self, srv_type: Any, *arguments: Any, **options: Any) -> Any:
        """Create a client, as rclpy."""
        load_type_support(srv_type)
        client = super().create_client(srv_type, *arguments, **options)
        return self._begun(client, ClientPort)

    def create_timer(self, *arguments: Any, **options: Any) -> Timer:
        """Create a timer, as rclpy."""
        timer = super().create_timer(*arguments, **options)
        return self._begun(timer, HostedTimerPort)

    def create_rate(self, *arguments: Any, **options: Any) -> Rate:
        """Create a rate, as rclpy."""
        rate: Any = super().create_rate(*arguments, **options)
        rate.__class__ = HostedRate
        rate._instance = self._composer_instance
        return rate  # type: ignore[no-any-return]

    def create_guard_condition(
        self, callback: Any, callback_group: CallbackGroup | None = None
    ) -> Any:
        """Create a guard condition, as rclpy."""
        guard: Any = super().create_guard_condition(callback, callback_group)
        guard.__class__ = HostedGuardCondition
        guard._instance = self._composer_instance
        return guard

    def add_waitable(self, waitable: Waitable) -> None:
        """Accept rclpy's own waitables: actions get their port when their constructor is done."""
        if not isinstance(waitable, ActionServer | ActionClient):
            raise HostingError(
                f"the class has a waitable of its own, {type(waitable).__name__};"
                " run it as an 'executable'"
            )
        super().add_waitable(waitable)

    def remove_waitable(self, waitable: Waitable) -> None:
        """Remove an action, which its own ``destroy`` does."""
        port = self._composer_instance.pop(waitable)
        if isinstance(port, HostedActionServer):
            port.withdraw()
        self._composer_instance.context.loop.remove(waitable)
        super().remove_waitable(waitable)

    def wait_for_message(
        self, msg_type: Any, topic: str, qos_profile: Any, timeout_s: float
    ) -> tuple[bool, Any]:
        """Wait for the next message of a topic, as rclpy's function, in any state of the node."""
        load_type_support(msg_type)
        instance = self._composer_instance
        loop = instance.context.loop
        received = FirstMessage()

        def receive(taken: Taken) -> None:
            received.put(taken[0])

        # Not a port: the gate would close it, and the class uses it only here.
        subscription = super().create_subscription(
            msg_type,
            topic,
            receive,
            qos_profile,
            event_callbacks=PendingQosEvents(None),  # type: ignore[arg-type]
        )
        instance.ports.awaited.add(subscription.topic_name)
        port = instance.ports.port(
            PortKind.SUBSCRIPTION, subscription.topic_name, msg_type, subscription.qos_profile
        )
        remove = instance.context.router.add_subscription(port, subscription, received)
        loop.add_subscription(subscription, receive)
        try:
            is_received = instance.wait_for(received, timeout_s)
        finally:
            remove()
            instance.ports.forget(port)
            loop.remove(subscription)
            super().destroy_subscription(subscription)
        return is_received, received.result() if is_received else None

    def adopt_action(self, action: Any, full_name: str) -> None:
        """Give an action server or client its port."""
        instance = self._composer_instance
        if isinstance(action, ActionServer):
            instance.entities.add(action, HostedActionServer(instance, action, full_name))
        else:
            instance.begin(action, HostedActionClient(instance, action, full_name))

    def _begun(self, entity: T, make_port: Callable[..., Any], *events: PendingQosEvents) -> T:
        """Give an entity its port, and return it."""
        instance = self._composer_instance
        try:
            port = make_port(instance, entity, *events)
        except BaseException:
            created: Any = entity
            super().destroy_publisher(created)
            super().destroy_subscription(created)
            super().destroy_service(created)
            raise
        declared = getattr(port, "port", None)
        instance.begin(entity, port, always_on=declared is not None and declared.always_on)
        return entity

    def destroy_publisher(self, publisher: Any) -> bool:
        """Destroy a publisher of the instance."""
        return self._composer_instance.remove(publisher)

    def destroy_subscription(self, subscription: Any) -> bool:
        """Destroy a subscription of the instance."""
        return self._composer_instance.remove(subscription)

    def destroy_service(self, service: Any) -> bool:
        """Destroy a service of the instance."""
        return self._composer_instance.remove(service)

    def destroy_client(self, client: Any) -> bool:
        """Destroy a client of the instance."""
        return self._composer_instance.remove(client)

    def destroy_timer(self, timer: Any) -> bool:
        """Destroy a timer of the instance."""
        return self._composer_instance.remove(timer)


class AdoptedLifecycleNode(AdoptedNode, LifecycleNode):
    """Leaves the state machine to the composer, which calls the handlers of the class."""

    def __init__(self, node_name: Any = None, **options: Any) -> None:
        options.pop("enable_communication_interface", None)
        AdoptedNode.__init__(self, node_name, **options)
        self.take_over_lifecycle()

    def take_over_lifecycle(self) -> None:
        """Do what ``LifecycleNodeMixin.__init__`` does, without a second state machine."""
        self._managed_entities = set()
        self._callbacks = {}
        self._state_machine = _StateMachine(self._composer_instance)

    def create_lifecycle_publisher(self, *arguments: Any, **options: Any) -> LifecyclePublisher:
        """Create a publisher that publishes between ``on_activate`` and ``on_deactivate``."""
        options["publisher_class"] = LifecyclePublisher
        publisher: Any = self.create_publisher(*arguments, **options)
        self._managed_entities.add(publisher)
        return publisher  # type: ignore[no-any-return]

    def destroy_lifecycle_publisher(self, publisher: LifecyclePublisher) -> bool:
        """Destroy a lifecycle publisher."""
        self._managed_entities.discard(publisher)
        return self.destroy_publisher(publisher)

    def _trigger(self, transition: str) -> TransitionCallbackReturn:
        """Request a transition. It runs later: a callback cannot wait for its own node."""
        self._composer_instance.settings.request(transition)
        return TransitionCallbackReturn.SUCCESS

    trigger_configure = partialmethod(_trigger, "configure")
    trigger_activate = partialmethod(_trigger, "activate")
    trigger_deactivate = partialmethod(_trigger, "deactivate")
    trigger_cleanup = partialmethod(_trigger, "cleanup")
    trigger_shutdown = partialmethod(_trigger, "shutdown")


class _StateMachine:
    """What classes read of rclpy's state machine."""

    initialized = True

    def __init__(self, instance: Instance) -> None:
        self._instance = instance

    @property
    def current_state(self) -> tuple[int, str]:
        """The id and the label of the state."""
        return self._instance.settings.current_state()


@cache
def adopted(target: Any) -> type[AdoptedNode]:
    """Return the class of hosted instances of ``target``. Raises HostingError."""
    base = AdoptedLifecycleNode if issubclass(target, LifecycleNode) else AdoptedNode
    metaclass: Any = type(target)
    try:
        made = metaclass(target.__name__, (target, base), {"__module__": target.__module__})
    except TypeError as error:
        raise HostingError(
            f"the class cannot be derived from: {error}; run it as an 'executable'"
        ) from error
    return made  # type: ignore[no-any-return]


def is_managed(target: type[Node]) -> bool:
    """Return whether the class has handlers of transitions."""
    return issubclass(target, LifecycleNode)


def action_name(node: AdoptedNode, kind: PortKind, name: str) -> str:
    """Return the full name of an action, as the node declares, remaps or expands it."""
    expanded = Node.resolve_service_name(node, name, only_expand=True)
    return node._composer_instance.settings.action_names.get((kind, expanded), expanded)
