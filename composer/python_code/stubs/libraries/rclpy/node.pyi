from collections.abc import Callable, Coroutine, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from _ros import MessageType, ServiceType
from rcl_interfaces.msg import FloatingPointRange as FloatingPointRange
from rcl_interfaces.msg import IntegerRange as IntegerRange
from rcl_interfaces.msg import ListParametersResult as ListParametersResult
from rcl_interfaces.msg import ParameterDescriptor as ParameterDescriptor
from rcl_interfaces.msg import ParameterEvent as ParameterEvent
from rcl_interfaces.msg import ParameterType as ParameterType
from rcl_interfaces.msg import ParameterValue as ParameterValue
from rcl_interfaces.msg import SetParametersResult as SetParametersResult
from rcl_interfaces.srv import ListParameters as ListParameters
from rclpy._rclpy_pybind11 import InvalidHandle as InvalidHandle
from rclpy._rclpy_pybind11 import NodeNameNonExistentError as NodeNameNonExistentError
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup as MutuallyExclusiveCallbackGroup
from rclpy.callback_groups import ReentrantCallbackGroup as ReentrantCallbackGroup
from rclpy.client import Client as Client
from rclpy.clock import Clock as Clock
from rclpy.clock import ROSClock as ROSClock
from rclpy.constants import S_TO_NS as S_TO_NS
from rclpy.context import Context as Context
from rclpy.event_handler import PublisherEventCallbacks as PublisherEventCallbacks
from rclpy.event_handler import SubscriptionEventCallbacks as SubscriptionEventCallbacks
from rclpy.exceptions import InvalidParameterTypeException as InvalidParameterTypeException
from rclpy.exceptions import InvalidParameterValueException as InvalidParameterValueException
from rclpy.exceptions import InvalidTopicNameException as InvalidTopicNameException
from rclpy.exceptions import NotInitializedException as NotInitializedException
from rclpy.exceptions import ParameterAlreadyDeclaredException as ParameterAlreadyDeclaredException
from rclpy.exceptions import ParameterImmutableException as ParameterImmutableException
from rclpy.exceptions import ParameterNotDeclaredException as ParameterNotDeclaredException
from rclpy.exceptions import ParameterUninitializedException as ParameterUninitializedException
from rclpy.executors import Executor as Executor
from rclpy.expand_topic_name import expand_topic_name as expand_topic_name
from rclpy.guard_condition import GuardCondition as GuardCondition
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.logging import get_logger as get_logger
from rclpy.logging_service import LoggingService as LoggingService
from rclpy.parameter import PARAMETER_SEPARATOR_STRING as PARAMETER_SEPARATOR_STRING
from rclpy.parameter import Parameter as Parameter
from rclpy.parameter import ParameterMsg as ParameterMsg
from rclpy.parameter_service import ParameterService as ParameterService
from rclpy.publisher import Publisher as Publisher
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos import qos_profile_parameter_events as qos_profile_parameter_events
from rclpy.qos import qos_profile_services_default as qos_profile_services_default
from rclpy.qos_overriding_options import QoSOverridingOptions as QoSOverridingOptions
from rclpy.service import Service as Service
from rclpy.subscription import Subscription as Subscription
from rclpy.time_source import TimeSource as TimeSource
from rclpy.timer import Rate as Rate
from rclpy.timer import Timer as Timer
from rclpy.topic_endpoint_info import TopicEndpointInfo as TopicEndpointInfo
from rclpy.type_description_service import TypeDescriptionService as TypeDescriptionService
from rclpy.type_support import check_is_valid_msg_type as check_is_valid_msg_type
from rclpy.type_support import check_is_valid_srv_type as check_is_valid_srv_type
from rclpy.utilities import get_default_context as get_default_context
from rclpy.validate_full_topic_name import validate_full_topic_name as validate_full_topic_name
from rclpy.validate_namespace import validate_namespace as validate_namespace
from rclpy.validate_node_name import validate_node_name as validate_node_name
from rclpy.validate_parameter_name import validate_parameter_name as validate_parameter_name
from rclpy.validate_topic_name import validate_topic_name as validate_topic_name
from rclpy.waitable import Waitable as Waitable

_T = TypeVar("_T", bound=MessageType)
_Req = TypeVar("_Req")
_Res = TypeVar("_Res")

HIDDEN_NODE_PREFIX: str

MsgType = TypeVar("MsgType")
SrvType = TypeVar("SrvType")
SrvTypeRequest = TypeVar("SrvTypeRequest")
SrvTypeResponse = TypeVar("SrvTypeResponse")

class Node:
    PARAM_REL_TOL: float
    # Private, and used by nodes nevertheless.
    _allow_undeclared_parameters: Any
    _clients: Any
    _clock: Any
    _context: Any
    _default_callback_group: Any
    _descriptors: Any
    _guards: Any
    _logger: Any
    _logger_service: Any
    _on_set_parameters_callbacks: Any
    _parameter_event_publisher: Any
    _parameter_overrides: Any
    _parameter_service: Any
    _parameters: Any
    _post_set_parameters_callbacks: Any
    _pre_set_parameters_callbacks: Any
    _publishers: Any
    _rate_group: Any
    _services: Any
    _subscriptions: Any
    _time_source: Any
    _timers: Any
    _type_description_service: Any

    def __init__(
        self,
        node_name: str,
        *,
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
    @property
    def publishers(self) -> Iterator[Publisher[Any]]: ...
    @property
    def subscriptions(self) -> Iterator[Subscription[Any]]: ...
    @property
    def clients(self) -> Iterator[Client[Any, Any]]: ...
    @property
    def services(self) -> Iterator[Service[Any, Any]]: ...
    @property
    def timers(self) -> Iterator[Timer]: ...
    @property
    def guards(self) -> Iterator[GuardCondition]: ...
    @property
    def waitables(self) -> Iterator[Waitable]: ...
    # None while no executor has the node, which is not declared: callbacks run in an executor.
    @property
    def executor(self) -> Executor: ...
    @executor.setter
    def executor(self, new_executor: Executor | None) -> None: ...
    @property
    def context(self) -> Context: ...
    @property
    def default_callback_group(self) -> CallbackGroup: ...
    @property
    def handle(self) -> Any: ...
    def get_name(self) -> str: ...
    def get_namespace(self) -> str: ...
    def get_clock(self) -> ROSClock: ...
    def get_logger(self) -> RcutilsLogger: ...
    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: ParameterDescriptor | None = None,
        ignore_override: bool = False,
    ) -> Parameter: ...
    def declare_parameters(
        self,
        namespace: str,
        parameters: Iterable[tuple[str] | tuple[str, Any] | tuple[str, Any, ParameterDescriptor]],
        ignore_override: bool = False,
    ) -> list[Parameter]: ...
    def undeclare_parameter(self, name: str) -> None: ...
    def has_parameter(self, name: str) -> bool: ...
    # rclpy is annotated with `Parameter.Type`, and gives its number.
    def get_parameter_types(self, names: list[str]) -> list[Any]: ...
    def get_parameter_type(self, name: str) -> Any: ...
    def get_parameters(self, names: list[str]) -> list[Parameter]: ...
    def get_parameter(self, name: str) -> Parameter: ...
    def get_parameter_or(
        self, name: str, alternative_value: Any = None
    ) -> Parameter: ...
    def get_parameters_by_prefix(self, prefix: str) -> dict[str, Any]: ...
    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[SetParametersResult]: ...
    def set_parameters_atomically(
        self, parameter_list: Sequence[Parameter]
    ) -> SetParametersResult: ...
    def list_parameters(self, prefixes: list[str], depth: int) -> ListParametersResult: ...
    def add_pre_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], list[Parameter]]
    ) -> None: ...
    def add_on_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], SetParametersResult]
    ) -> None: ...
    def add_post_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], object]
    ) -> None: ...
    def remove_pre_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], list[Parameter]]
    ) -> None: ...
    def remove_on_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], SetParametersResult]
    ) -> None: ...
    def remove_post_set_parameters_callback(
        self, callback: Callable[[list[Parameter]], object]
    ) -> None: ...
    def describe_parameter(self, name: str) -> ParameterDescriptor: ...
    def describe_parameters(self, names: list[str]) -> list[ParameterDescriptor]: ...
    def set_descriptor(
        self,
        name: str,
        descriptor: ParameterDescriptor,
        alternative_value: ParameterValue | None = None,
    ) -> ParameterValue: ...
    def add_waitable(self, waitable: Waitable) -> None: ...
    def remove_waitable(self, waitable: Waitable) -> None: ...
    def resolve_topic_name(self, topic: str, *, only_expand: bool = False) -> str: ...
    def resolve_service_name(self, service: str, *, only_expand: bool = False) -> str: ...
    def create_publisher(
        self,
        msg_type: type[_T],
        topic: str,
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: PublisherEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        publisher_class: type[Publisher[Any]] = ...,
    ) -> Publisher[_T]: ...
    # A callback with a second argument is given the times of the message as well.
    def create_subscription(
        self,
        msg_type: type[_T],
        topic: str,
        callback: Callable[[_T], object] | Callable[[_T, Any], object],
        qos_profile: QoSProfile | int,
        *,
        callback_group: CallbackGroup | None = None,
        event_callbacks: SubscriptionEventCallbacks | None = None,
        qos_overriding_options: QoSOverridingOptions | None = None,
        raw: bool = False,
    ) -> Subscription[Any]: ...
    def create_client(
        self,
        srv_type: type[ServiceType[_Req, _Res]],
        srv_name: str,
        *,
        qos_profile: QoSProfile = ...,
        callback_group: CallbackGroup | None = None,
    ) -> Client[_Req, _Res]: ...
    def create_service(
        self,
        srv_type: type[ServiceType[_Req, _Res]],
        srv_name: str,
        callback: Callable[[_Req, _Res], _Res | Coroutine[Any, Any, _Res]],
        *,
        qos_profile: QoSProfile = ...,
        callback_group: CallbackGroup | None = None,
    ) -> Service[Any, Any]: ...
    def create_timer(
        self,
        timer_period_sec: float,
        callback: Callable[[], object],
        callback_group: CallbackGroup | None = None,
        clock: Clock | None = None,
        autostart: bool = True,
    ) -> Timer: ...
    def create_guard_condition(
        self, callback: Callable[[], object], callback_group: CallbackGroup | None = None
    ) -> GuardCondition: ...
    def create_rate(self, frequency: float, clock: Clock | None = None) -> Rate: ...
    # They give False for what is not in the node, which includes None.
    def destroy_publisher(self, publisher: Publisher[Any] | None) -> bool: ...
    def destroy_subscription(self, subscription: Subscription[Any] | None) -> bool: ...
    def destroy_client(self, client: Client[Any, Any] | None) -> bool: ...
    def destroy_service(self, service: Service[Any, Any] | None) -> bool: ...
    def destroy_timer(self, timer: Timer | None) -> bool: ...
    def destroy_guard_condition(self, guard: GuardCondition | None) -> bool: ...
    def destroy_rate(self, rate: Rate) -> bool: ...
    # In overrides of users it gives None or, as in old versions, a bool.
    def destroy_node(self) -> Any: ...
    def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]: ...
    def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]: ...
    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]: ...
    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]: ...
    def get_topic_names_and_types(
        self, no_demangle: bool = False
    ) -> list[tuple[str, list[str]]]: ...
    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]: ...
    def get_node_names(self) -> list[str]: ...
    def get_fully_qualified_node_names(self) -> list[str]: ...
    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]: ...
    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]: ...
    def get_fully_qualified_name(self) -> str: ...
    def count_publishers(self, topic_name: str) -> int: ...
    def count_subscribers(self, topic_name: str) -> int: ...
    def count_clients(self, service_name: str) -> int: ...
    def count_services(self, service_name: str) -> int: ...
    def get_publishers_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]: ...
    def get_subscriptions_info_by_topic(
        self, topic_name: str, no_mangle: bool = False
    ) -> list[TopicEndpointInfo]: ...
    def wait_for_node(self, fully_qualified_node_name: str, timeout: float) -> bool: ...
