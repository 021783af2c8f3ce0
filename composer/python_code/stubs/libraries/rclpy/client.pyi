from typing import Any, Generic, TypeVar

from _ros import ServiceType
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.clock import Clock as Clock
from rclpy.context import Context as Context
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState as ServiceIntrospectionState
from rclpy.task import Future as Future

_Req = TypeVar("_Req")
_Res = TypeVar("_Res")

SrvType = TypeVar("SrvType")
SrvTypeRequest = TypeVar("SrvTypeRequest")
SrvTypeResponse = TypeVar("SrvTypeResponse")

class Client(Generic[_Req, _Res]):
    context: Context
    srv_type: type[ServiceType[_Req, _Res]]
    srv_name: str
    qos_profile: QoSProfile
    callback_group: CallbackGroup
    def __init__(
        self,
        context: Context,
        client_impl: Any,
        srv_type: type[ServiceType[_Req, _Res]],
        srv_name: str,
        qos_profile: QoSProfile,
        callback_group: CallbackGroup,
    ) -> None: ...
    def call(self, request: _Req, timeout_sec: float | None = None) -> _Res: ...
    def call_async(self, request: _Req) -> Future[_Res]: ...
    def get_pending_request(self, sequence_number: int) -> Future[_Res]: ...
    def remove_pending_request(self, future: Future[_Res]) -> None: ...
    def service_is_ready(self) -> bool: ...
    def wait_for_service(self, timeout_sec: float | None = None) -> bool: ...
    def configure_introspection(
        self,
        clock: Clock,
        service_event_qos_profile: QoSProfile,
        introspection_state: ServiceIntrospectionState,
    ) -> None: ...
    @property
    def handle(self) -> Any: ...
    @property
    def service_name(self) -> str: ...
    @property
    def logger_name(self) -> str: ...
    def destroy(self) -> None: ...
