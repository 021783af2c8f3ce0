from collections.abc import Callable, Coroutine
from typing import Any, Generic, TypeVar

from _ros import ServiceType
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.clock import Clock as Clock
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.service_introspection import ServiceIntrospectionState as ServiceIntrospectionState

_Req = TypeVar("_Req")
_Res = TypeVar("_Res")

SrvType = TypeVar("SrvType")
SrvTypeRequest = TypeVar("SrvTypeRequest")
SrvTypeResponse = TypeVar("SrvTypeResponse")

class Service(Generic[_Req, _Res]):
    srv_type: type[ServiceType[_Req, _Res]]
    srv_name: str
    callback: Any
    callback_group: CallbackGroup
    qos_profile: QoSProfile
    def __init__(
        self,
        service_impl: Any,
        srv_type: type[ServiceType[_Req, _Res]],
        srv_name: str,
        callback: Callable[[_Req, _Res], _Res | Coroutine[Any, Any, _Res]],
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
    ) -> None: ...
    def send_response(self, response: _Res, header: Any) -> None: ...
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
