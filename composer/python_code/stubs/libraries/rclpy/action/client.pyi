from collections.abc import Callable
from typing import Any, ClassVar, Generic, TypeVar

import builtin_interfaces.msg
from _ros import ActionType, MessageType
from action_msgs.msg import GoalStatus as GoalStatus
from action_msgs.srv import CancelGoal as CancelGoal
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
from unique_identifier_msgs.msg import UUID as UUID

_G = TypeVar("_G")
_R = TypeVar("_R")
_F = TypeVar("_F")

# The messages that an action has besides its three parts.
class _FeedbackMessage(MessageType, Generic[_F]):
    goal_id: UUID
    feedback: _F

class _GetResultResponse(MessageType, Generic[_R]):
    status: int
    result: _R

class ClientGoalHandle(Generic[_G, _R, _F]):
    __hash__: ClassVar[None]  # type: ignore[assignment]
    def __init__(
        self, action_client: ActionClient[_G, _R, _F], goal_id: UUID, goal_response: Any
    ) -> None: ...
    def __eq__(self, other: object) -> bool: ...
    @property
    def goal_id(self) -> UUID: ...
    @property
    def stamp(self) -> builtin_interfaces.msg.Time: ...
    @property
    def accepted(self) -> bool: ...
    @property
    def status(self) -> int: ...
    def cancel_goal(self) -> CancelGoal.Response: ...
    def cancel_goal_async(self) -> Future[CancelGoal.Response]: ...
    def get_result(self) -> _GetResultResponse[_R]: ...
    def get_result_async(self) -> Future[_GetResultResponse[_R]]: ...

class ActionClient(Waitable, Generic[_G, _R, _F]):
    # Private, and used by nodes nevertheless.
    _action_name: Any
    _action_type: Any
    _cancel_goal: Any
    _cancel_goal_async: Any
    _client_handle: Any
    _feedback_callbacks: Any
    _get_result: Any
    _get_result_async: Any
    _goal_handles: Any
    _node: Any
    def __init__(
        self,
        node: Node,
        action_type: type[ActionType[_G, _R, _F]],
        action_name: str,
        *,
        callback_group: CallbackGroup | None = None,
        goal_service_qos_profile: QoSProfile = ...,
        result_service_qos_profile: QoSProfile = ...,
        cancel_service_qos_profile: QoSProfile = ...,
        feedback_sub_qos_profile: QoSProfile = ...,
        status_sub_qos_profile: QoSProfile = ...,
    ) -> None: ...
    # The keywords are those of send_goal_async.
    def send_goal(
        self,
        goal: _G,
        *,
        feedback_callback: Callable[[_FeedbackMessage[_F]], object] | None = None,
        goal_uuid: UUID | None = None,
    ) -> _GetResultResponse[_R]: ...
    def send_goal_async(
        self,
        goal: _G,
        feedback_callback: Callable[[_FeedbackMessage[_F]], object] | None = None,
        goal_uuid: UUID | None = None,
    ) -> Future[ClientGoalHandle[_G, _R, _F]]: ...
    def server_is_ready(self) -> bool: ...
    def wait_for_server(self, timeout_sec: float | None = None) -> bool: ...
    def destroy(self) -> None: ...
