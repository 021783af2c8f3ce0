from collections.abc import Callable, Sequence
from typing import TypeVar

from rcl_interfaces.msg import ParameterEvent as ParameterEvent
from rcl_interfaces.srv import DescribeParameters as DescribeParameters
from rcl_interfaces.srv import GetParameters as GetParameters
from rcl_interfaces.srv import GetParameterTypes as GetParameterTypes
from rcl_interfaces.srv import ListParameters as ListParameters
from rcl_interfaces.srv import SetParameters as SetParameters
from rcl_interfaces.srv import SetParametersAtomically as SetParametersAtomically
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks as SubscriptionEventCallbacks
from rclpy.node import Node as Node
from rclpy.parameter import Parameter as Parameter
from rclpy.parameter import ParameterMsg as ParameterMsg
from rclpy.parameter import parameter_dict_from_yaml_file as parameter_dict_from_yaml_file
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos import qos_profile_parameter_events as qos_profile_parameter_events
from rclpy.qos import qos_profile_services_default as qos_profile_services_default
from rclpy.qos_overriding_options import QoSOverridingOptions as QoSOverridingOptions
from rclpy.subscription import Subscription as Subscription
from rclpy.task import Future as Future

_T = TypeVar("_T")
_Done = Callable[[Future[_T]], object] | None

class AsyncParameterClient:
    remote_node_name: str
    node: Node
    def __init__(
        self,
        node: Node,
        remote_node_name: str,
        qos_profile: QoSProfile = ...,
        callback_group: CallbackGroup | None = None,
    ) -> None: ...
    def services_are_ready(self) -> bool: ...
    def wait_for_services(self, timeout_sec: float | None = None) -> bool: ...
    def list_parameters(
        self,
        prefixes: list[str] | None = None,
        depth: int | None = None,
        callback: _Done[ListParameters.Response] = None,
    ) -> Future[ListParameters.Response]: ...
    def get_parameters(
        self, names: list[str], callback: _Done[GetParameters.Response] = None
    ) -> Future[GetParameters.Response]: ...
    def set_parameters(
        self,
        parameters: Sequence[Parameter | ParameterMsg],
        callback: _Done[SetParameters.Response] = None,
    ) -> Future[SetParameters.Response]: ...
    def describe_parameters(
        self, names: list[str], callback: _Done[DescribeParameters.Response] = None
    ) -> Future[DescribeParameters.Response]: ...
    def get_parameter_types(
        self, names: list[str], callback: _Done[GetParameterTypes.Response] = None
    ) -> Future[GetParameterTypes.Response]: ...
    def set_parameters_atomically(
        self,
        parameters: Sequence[Parameter | ParameterMsg],
        callback: _Done[SetParametersAtomically.Response] = None,
    ) -> Future[SetParametersAtomically.Response]: ...
    def delete_parameters(
        self, names: list[str], callback: _Done[SetParameters.Response] = None
    ) -> Future[SetParameters.Response]: ...
    def load_parameter_file(
        self,
        parameter_file: str,
        use_wildcard: bool = False,
        callback: _Done[SetParameters.Response] = None,
    ) -> Future[SetParameters.Response]: ...
    def load_parameter_file_atomically(
        self,
        parameter_file: str,
        use_wildcard: bool = False,
        callback: _Done[SetParametersAtomically.Response] = None,
    ) -> Future[SetParametersAtomically.Response]: ...
    def on_parameter_event(
        self,
        callback: Callable[[ParameterEvent], object],
        qos_profile: QoSProfile = ...,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription[ParameterEvent]: ...
