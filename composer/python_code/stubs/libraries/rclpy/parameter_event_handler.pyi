from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import ParameterEvent as ParameterEvent
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks as SubscriptionEventCallbacks
from rclpy.node import Node as Node
from rclpy.parameter import Parameter as Parameter
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos import qos_profile_parameter_events as qos_profile_parameter_events
from rclpy.qos_overriding_options import QoSOverridingOptions as QoSOverridingOptions
from rclpy.subscription import Subscription

class ParameterCallbackHandle:
    parameter_name: str
    node_name: str
    callback: Callable[[Any], object]
    mutex: Any
    def __init__(
        self, parameter_name: str, node_name: str, callback: Callable[[Any], object]
    ) -> None: ...

class ParameterEventCallbackHandle:
    callback: Callable[[ParameterEvent], object]
    mutex: Any
    def __init__(self, callback: Callable[[ParameterEvent], object]) -> None: ...

class ParameterEventHandler:
    node: Node
    qos_profile: QoSProfile
    parameter_event_subscription: Subscription[ParameterEvent]
    Callbacks: Any
    def __init__(
        self,
        node: Node,
        qos_profile: QoSProfile = ...,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> None: ...
    def destroy(self) -> None: ...
    # rclpy is annotated with its own `Parameter`, and gives the messages of the event.
    @staticmethod
    def get_parameter_from_event(
        event: ParameterEvent, parameter_name: str, node_name: str
    ) -> Any: ...
    @staticmethod
    def get_parameters_from_event(event: ParameterEvent) -> Iterable[Any]: ...
    def add_parameter_callback(
        self, parameter_name: str, node_name: str, callback: Callable[[Any], object]
    ) -> ParameterCallbackHandle: ...
    def remove_parameter_callback(self, handle: ParameterCallbackHandle) -> None: ...
    def add_parameter_event_callback(
        self, callback: Callable[[ParameterEvent], object]
    ) -> ParameterEventCallbackHandle: ...
    def remove_parameter_event_callback(self, handle: ParameterEventCallbackHandle) -> None: ...
