from collections.abc import Callable, Iterable
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor as ParameterDescriptor
from rcl_interfaces.msg import SetParametersResult as SetParametersResult
from rclpy.duration import Duration as Duration
from rclpy.exceptions import ParameterAlreadyDeclaredException as ParameterAlreadyDeclaredException
from rclpy.parameter import Parameter as Parameter
from rclpy.publisher import Publisher as Publisher
from rclpy.qos import QoSDurabilityPolicy as QoSDurabilityPolicy
from rclpy.qos import QoSHistoryPolicy as QoSHistoryPolicy
from rclpy.qos import QoSLivelinessPolicy as QoSLivelinessPolicy
from rclpy.qos import QoSPolicyKind as QoSPolicyKind
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.qos import QoSReliabilityPolicy as QoSReliabilityPolicy
from rclpy.subscription import Subscription as Subscription

class InvalidQosOverridesError(Exception): ...

QosCallbackResult = SetParametersResult
QosCallbackType = Callable[[QoSProfile], SetParametersResult]
QoSProfileAttributes = Any

class QoSOverridingOptions:
    def __init__(
        self,
        policy_kinds: Iterable[QoSPolicyKind],
        *,
        callback: Callable[[QoSProfile], SetParametersResult] | None = None,
        entity_id: str | None = None,
    ) -> None: ...
    @property
    def policy_kinds(self) -> Iterable[QoSPolicyKind]: ...
    @property
    def callback(self) -> Callable[[QoSProfile], SetParametersResult] | None: ...
    @property
    def entity_id(self) -> str | None: ...
    @classmethod
    def with_default_policies(
        cls,
        *,
        callback: Callable[[QoSProfile], SetParametersResult] | None = None,
        entity_id: str | None = None,
    ) -> QoSOverridingOptions: ...
