# Type stubs of rclpy 7.1 (ROS 2 Jazzy), which itself is only partly typed and does not say which
# message type a publisher, a client or an action has. `compose validate` gives these to the type
# checker, so that it can check classes that use rclpy where ROS is not installed; `compose stubs`
# writes them for editors. A test (tests/ros/hosting/test_rclpy_stubs.py) compares them with rclpy.
#
# - Publishers, clients, ... are generic over the generated classes of messages; see `_ros`.
# - What users pass a callback for may be a coroutine function, so results of callbacks that rclpy
#   ignores are `object`.
# - Arguments of methods that users override are positional-only: rclpy passes them by position,
#   so an override may name them as it likes.

from typing import Any as _Any

from rclpy import action as action
from rclpy import callback_groups as callback_groups
from rclpy import client as client
from rclpy import clock as clock
from rclpy import clock_type as clock_type
from rclpy import constants as constants
from rclpy import context as context
from rclpy import destroyable as destroyable
from rclpy import duration as duration
from rclpy import event_handler as event_handler
from rclpy import exceptions as exceptions
from rclpy import executors as executors
from rclpy import expand_topic_name as expand_topic_name
from rclpy import guard_condition as guard_condition
from rclpy import impl as impl
from rclpy import lifecycle as lifecycle
from rclpy import logging as logging
from rclpy import logging_service as logging_service
from rclpy import node as node
from rclpy import parameter as parameter
from rclpy import parameter_service as parameter_service
from rclpy import publisher as publisher
from rclpy import qos as qos
from rclpy import qos_overriding_options as qos_overriding_options
from rclpy import service as service
from rclpy import service_introspection as service_introspection
from rclpy import signals as signals
from rclpy import subscription as subscription
from rclpy import task as task
from rclpy import time as time
from rclpy import time_source as time_source
from rclpy import timer as timer
from rclpy import topic_endpoint_info as topic_endpoint_info
from rclpy import type_description_service as type_description_service
from rclpy import type_hash as type_hash
from rclpy import type_support as type_support
from rclpy import utilities as utilities
from rclpy import validate_full_topic_name as validate_full_topic_name
from rclpy import validate_namespace as validate_namespace
from rclpy import validate_node_name as validate_node_name
from rclpy import validate_parameter_name as validate_parameter_name
from rclpy import validate_topic_name as validate_topic_name
from rclpy import waitable as waitable
from rclpy.context import Context as Context
from rclpy.executors import Executor as _Executor
from rclpy.node import Node as _Node
from rclpy.parameter import Parameter as Parameter
from rclpy.signals import SignalHandlerOptions as SignalHandlerOptions
from rclpy.signals import install_signal_handlers as install_signal_handlers
from rclpy.signals import uninstall_signal_handlers as uninstall_signal_handlers
from rclpy.task import Future as Future
from rclpy.utilities import get_default_context as get_default_context
from rclpy.utilities import get_rmw_implementation_identifier as get_rmw_implementation_identifier
from rclpy.utilities import ok as ok
from rclpy.utilities import try_shutdown as try_shutdown

# From Kilted on, `init` gives a context manager, which many files use in their `main`.
def init(
    *,
    args: list[str] | None = None,
    context: Context | None = None,
    domain_id: int | None = None,
    signal_handler_options: SignalHandlerOptions | None = None,
) -> _Any: ...
def shutdown(*, context: Context | None = None, uninstall_handlers: bool | None = None) -> None: ...
def get_global_executor() -> _Executor: ...
def create_node(
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
) -> _Node: ...
def spin(node: _Node, executor: _Executor | None = None) -> None: ...
def spin_once(
    node: _Node, *, executor: _Executor | None = None, timeout_sec: float | None = None
) -> None: ...
def spin_until_future_complete(
    node: _Node,
    future: Future[_Any],
    executor: _Executor | None = None,
    timeout_sec: float | None = None,
) -> None: ...
