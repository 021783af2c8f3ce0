from collections.abc import Callable
from enum import IntEnum
from typing import Any, TypeVar

from rclpy._rclpy_pybind11 import UnsupportedEventTypeError as UnsupportedEventTypeError
from rclpy.callback_groups import CallbackGroup as CallbackGroup
from rclpy.logging import get_logger as get_logger
from rclpy.qos import qos_policy_name_from_kind as qos_policy_name_from_kind
from rclpy.waitable import NumberOfEntities as NumberOfEntities
from rclpy.waitable import Waitable as Waitable

class QoSPublisherEventType(IntEnum):
    RCL_PUBLISHER_OFFERED_DEADLINE_MISSED = ...
    RCL_PUBLISHER_LIVELINESS_LOST = ...
    RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS = ...
    RCL_PUBLISHER_INCOMPATIBLE_TYPE = ...
    RCL_PUBLISHER_MATCHED = ...

class QoSSubscriptionEventType(IntEnum):
    RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED = ...
    RCL_SUBSCRIPTION_LIVELINESS_CHANGED = ...
    RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS = ...
    RCL_SUBSCRIPTION_MESSAGE_LOST = ...
    RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE = ...
    RCL_SUBSCRIPTION_MATCHED = ...

class QoSRequestedDeadlineMissedInfo:
    total_count: int
    total_count_change: int

class QoSOfferedDeadlineMissedInfo:
    total_count: int
    total_count_change: int

class QoSLivelinessLostInfo:
    total_count: int
    total_count_change: int

class QoSMessageLostInfo:
    total_count: int
    total_count_change: int

class QoSLivelinessChangedInfo:
    alive_count: int
    not_alive_count: int
    alive_count_change: int
    not_alive_count_change: int

class QoSRequestedIncompatibleQoSInfo:
    total_count: int
    total_count_change: int
    last_policy_kind: Any

class QoSSubscriptionMatchedInfo:
    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int

class IncompatibleTypeInfo:
    total_count_change: int

QoSOfferedIncompatibleQoSInfo = QoSRequestedIncompatibleQoSInfo
QoSPublisherMatchedInfo = QoSSubscriptionMatchedInfo

_T = TypeVar("_T")
_Callback = Callable[[_T], object] | None

class EventHandler(Waitable):
    event_type: IntEnum
    callback: Callable[[Any], object]
    def __init__(
        self,
        *,
        callback_group: CallbackGroup,
        callback: Callable[[Any], object],
        event_type: IntEnum,
        parent_impl: Any,
    ) -> None: ...
    def destroy(self) -> None: ...

class QoSEventHandler(EventHandler): ...

class SubscriptionEventCallbacks:
    deadline: _Callback[QoSRequestedDeadlineMissedInfo]
    incompatible_qos: _Callback[QoSRequestedIncompatibleQoSInfo]
    liveliness: _Callback[QoSLivelinessChangedInfo]
    message_lost: _Callback[QoSMessageLostInfo]
    incompatible_type: _Callback[IncompatibleTypeInfo]
    matched: _Callback[QoSSubscriptionMatchedInfo]
    use_default_callbacks: bool
    def __init__(
        self,
        *,
        deadline: _Callback[QoSRequestedDeadlineMissedInfo] = None,
        incompatible_qos: _Callback[QoSRequestedIncompatibleQoSInfo] = None,
        liveliness: _Callback[QoSLivelinessChangedInfo] = None,
        message_lost: _Callback[QoSMessageLostInfo] = None,
        incompatible_type: _Callback[IncompatibleTypeInfo] = None,
        matched: _Callback[QoSSubscriptionMatchedInfo] = None,
        use_default_callbacks: bool = True,
    ) -> None: ...
    def create_event_handlers(
        self, callback_group: CallbackGroup, subscription: Any, topic_name: str
    ) -> list[EventHandler]: ...

class PublisherEventCallbacks:
    deadline: _Callback[QoSOfferedDeadlineMissedInfo]
    liveliness: _Callback[QoSLivelinessLostInfo]
    incompatible_qos: _Callback[QoSRequestedIncompatibleQoSInfo]
    incompatible_type: _Callback[IncompatibleTypeInfo]
    matched: _Callback[QoSPublisherMatchedInfo]
    use_default_callbacks: bool
    def __init__(
        self,
        *,
        deadline: _Callback[QoSOfferedDeadlineMissedInfo] = None,
        liveliness: _Callback[QoSLivelinessLostInfo] = None,
        incompatible_qos: _Callback[QoSRequestedIncompatibleQoSInfo] = None,
        incompatible_type: _Callback[IncompatibleTypeInfo] = None,
        matched: _Callback[QoSPublisherMatchedInfo] = None,
        use_default_callbacks: bool = True,
    ) -> None: ...
    def create_event_handlers(
        self, callback_group: CallbackGroup, publisher: Any, topic_name: str
    ) -> list[EventHandler]: ...
