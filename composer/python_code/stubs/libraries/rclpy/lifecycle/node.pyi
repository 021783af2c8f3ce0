from typing import Any, NamedTuple, TypeVar

from _ros import MessageType
from rclpy._rclpy_pybind11 import TransitionCallbackReturnType as TransitionCallbackReturn
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.lifecycle.managed_entity import ManagedEntity as ManagedEntity
from rclpy.lifecycle.publisher import LifecyclePublisher as LifecyclePublisher
from rclpy.node import Node as Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.service import Service as Service
from rclpy.type_support import check_is_valid_srv_type as check_is_valid_srv_type

_T = TypeVar("_T", bound=MessageType)

__all__ = [
    "CallbackGroup",
    "LifecycleNode",
    "LifecycleNodeMixin",
    "LifecyclePublisher",
    "LifecycleState",
    "ManagedEntity",
    "Node",
    "QoSProfile",
    "Service",
    "TransitionCallbackReturn",
    "check_is_valid_srv_type",
]

class LifecycleState(NamedTuple):
    label: str
    state_id: int

class LifecycleNodeMixin(ManagedEntity):
    _state_machine: Any
    _managed_entities: Any
    def __init__(
        self,
        *,
        enable_communication_interface: bool = True,
        callback_group: CallbackGroup | None = None,
    ) -> None: ...
    def trigger_configure(self) -> TransitionCallbackReturn: ...
    def trigger_cleanup(self) -> TransitionCallbackReturn: ...
    def trigger_shutdown(self) -> TransitionCallbackReturn: ...
    def trigger_activate(self) -> TransitionCallbackReturn: ...
    def trigger_deactivate(self) -> TransitionCallbackReturn: ...
    def add_managed_entity(self, entity: ManagedEntity) -> None: ...
    # As `Node.create_publisher`, whose arguments it passes on.
    def create_lifecycle_publisher(
        self,
        msg_type: type[_T],
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
    ) -> LifecyclePublisher[_T]: ...
    def destroy_lifecycle_publisher(self, publisher: LifecyclePublisher[Any]) -> bool: ...

class LifecycleNode(LifecycleNodeMixin, Node):
    def __init__(
        self,
        node_name: str,
        *,
        enable_communication_interface: bool = True,
        context: Context | None = None,
        cli_args: list[str] | None = None,
        namespace: str | None = None,
        use_global_arguments: bool = True,
        enable_rosout: bool = True,
        start_parameter_services: bool = True,
        parameter_overrides: list[Parameter] | None = None,
        allow_undeclared_parameters: bool = False,
        automatically_declare_parameters_from_overrides: bool = False,
        enable_logger_service: bool = False,
    ) -> None: ...
