from enum import Enum
from typing import Any, Generic, TypeVar

from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.event_handler import EventHandler as EventHandler
from rclpy.event_handler import SubscriptionEventCallbacks as SubscriptionEventCallbacks
from rclpy.qos import QoSProfile as QoSProfile

_T = TypeVar("_T")

MsgType = TypeVar("MsgType")

class Subscription(Generic[_T]):
    class CallbackType(Enum):
        MessageOnly = 0
        WithMessageInfo = 1

    msg_type: type[_T]
    topic: str
    callback: Any
    callback_group: CallbackGroup
    qos_profile: QoSProfile
    raw: bool
    event_handlers: list[EventHandler]
    def __init__(
        self,
        subscription_impl: Any,
        msg_type: type[_T],
        topic: str,
        callback: Any,
        callback_group: CallbackGroup,
        qos_profile: QoSProfile,
        raw: bool,
        event_callbacks: SubscriptionEventCallbacks,
    ) -> None: ...
    def get_publisher_count(self) -> int: ...
    @property
    def handle(self) -> Any: ...
    def destroy(self) -> None: ...
    @property
    def topic_name(self) -> str: ...
    @property
    def logger_name(self) -> str: ...
