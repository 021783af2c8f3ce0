from typing import Any, Generic, TypeVar

from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.duration import Duration as Duration
from rclpy.event_handler import EventHandler as EventHandler
from rclpy.event_handler import PublisherEventCallbacks as PublisherEventCallbacks
from rclpy.qos import QoSProfile as QoSProfile

_T = TypeVar("_T")

MsgType = TypeVar("MsgType")

class Publisher(Generic[_T]):
    msg_type: type[_T]
    topic: str
    qos_profile: QoSProfile
    event_handlers: list[EventHandler]
    def __init__(
        self,
        publisher_impl: Any,
        msg_type: type[_T],
        topic: str,
        qos_profile: QoSProfile,
        event_callbacks: PublisherEventCallbacks,
        callback_group: CallbackGroup,
    ) -> None: ...
    def publish(self, msg: _T | bytes) -> None: ...
    def get_subscription_count(self) -> int: ...
    @property
    def topic_name(self) -> str: ...
    @property
    def handle(self) -> Any: ...
    @property
    def logger_name(self) -> str: ...
    def destroy(self) -> None: ...
    def assert_liveliness(self) -> None: ...
    def wait_for_all_acked(self, timeout: Duration = ...) -> bool: ...
