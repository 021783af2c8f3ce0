from collections.abc import Callable, Coroutine
from enum import Enum
from typing import Any, ClassVar, Generic, TypeVar

from _ros import ActionType
from action_msgs.msg import GoalInfo as GoalInfo
from action_msgs.msg import GoalStatus as GoalStatus
from rclpy._rclpy_pybind11 import GoalEvent as GoalEvent
from rclpy._rclpy_pybind11 import RCLError as RCLError
from rclpy.callback_groups import CallbackGroup
from rclpy.executors import await_or_execute as await_or_execute
from rclpy.node import Node
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos import qos_profile_action_status_default as qos_profile_action_status_default
from rclpy.qos import qos_profile_services_default as qos_profile_services_default
from rclpy.task import Future as Future
from rclpy.type_support import check_for_type_support as check_for_type_support
from rclpy.waitable import NumberOfEntities as NumberOfEntities
from rclpy.waitable import Waitable as Waitable
from unique_identifier_msgs.msg import UUID

_G = TypeVar("_G")
_R = TypeVar("_R")
_F = TypeVar("_F")

class GoalResponse(Enum):
    REJECT = 1
    ACCEPT = 2

class CancelResponse(Enum):
    REJECT = 1
    ACCEPT = 2

# The result is not part of the handle here: pyrefly would take it from how a function annotates
# its argument, and then not compare what it returns.
_Execute = Callable[[ServerGoalHandle[_G, Any, _F]], _R | Coroutine[Any, Any, _R]]
_Goal = Callable[[_G], GoalResponse | Coroutine[Any, Any, GoalResponse]]
_Accepted = Callable[[ServerGoalHandle[_G, Any, _F]], object]
_Cancel = Callable[
    [ServerGoalHandle[_G, Any, _F]], CancelResponse | Coroutine[Any, Any, CancelResponse]
]

class ServerGoalHandle(Generic[_G, _R, _F]):
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def __init__(
        self, action_server: ActionServer[_G, _R, _F], goal_info: GoalInfo, goal_request: _G
    ) -> None: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def request(self) -> _G: ...
    @property
    def goal_id(self) -> UUID: ...
    @property
    def is_active(self) -> bool: ...
    @property
    def is_cancel_requested(self) -> bool: ...
    @property
    def status(self) -> int: ...
    def execute(self, execute_callback: _Execute[_G, _F, _R] | None = None) -> None: ...
    def publish_feedback(self, feedback: _F) -> None: ...
    def succeed(self) -> None: ...
    def abort(self) -> None: ...
    def canceled(self) -> None: ...
    def destroy(self) -> None: ...

def default_handle_accepted_callback(goal_handle: ServerGoalHandle[Any, Any, Any]) -> None: ...
def default_goal_callback(goal_request: Any) -> GoalResponse: ...
def default_cancel_callback(cancel_request: Any) -> CancelResponse: ...

class ActionServer(Waitable, Generic[_G, _R, _F]):
    _goal_handles: Any
    _handle: Any
    _node: Any
    _result_futures: Any
    def __init__(
        self,
        node: Node,
        action_type: type[ActionType[_G, _R, _F]],
        action_name: str,
        execute_callback: _Execute[_G, _F, _R],
        *,
        callback_group: CallbackGroup | None = None,
        goal_callback: _Goal[_G] = ...,
        handle_accepted_callback: _Accepted[_G, _F] = ...,
        cancel_callback: _Cancel[_G, _F] = ...,
        goal_service_qos_profile: QoSProfile = ...,
        result_service_qos_profile: QoSProfile = ...,
        cancel_service_qos_profile: QoSProfile = ...,
        feedback_pub_qos_profile: QoSProfile = ...,
        status_pub_qos_profile: QoSProfile = ...,
        result_timeout: float = 900,
    ) -> None: ...
    @property
    def action_type(self) -> type[ActionType[_G, _R, _F]]: ...
    def notify_execute(
        self,
        goal_handle: ServerGoalHandle[_G, _R, _F],
        execute_callback: _Execute[_G, _F, _R] | None,
    ) -> None: ...
    def notify_goal_done(self) -> None: ...
    def register_handle_accepted_callback(
        self, handle_accepted_callback: _Accepted[_G, _F] | None
    ) -> None: ...
    def register_goal_callback(self, goal_callback: _Goal[_G] | None) -> None: ...
    def register_cancel_callback(self, cancel_callback: _Cancel[_G, _F] | None) -> None: ...
    def register_execute_callback(self, execute_callback: _Execute[_G, _F, _R]) -> None: ...
    def destroy(self) -> None: ...
