from enum import Enum, IntEnum
from typing import Any, ClassVar

from rclpy._rclpy_pybind11 import QoSCompatibility as QoSCompatibility
from rclpy.duration import Duration as Duration

class QoSPolicyKind(IntEnum):
    INVALID = 1
    DURABILITY = 2
    DEADLINE = 4
    LIVELINESS = 8
    RELIABILITY = 16
    HISTORY = 32
    LIFESPAN = 64
    DEPTH = 128
    LIVELINESS_LEASE_DURATION = 256
    AVOID_ROS_NAMESPACE_CONVENTIONS = 512

def qos_policy_name_from_kind(policy_kind: QoSPolicyKind | int) -> str: ...
def qos_check_compatible(
    publisher_qos: QoSProfile, subscription_qos: QoSProfile
) -> tuple[QoSCompatibility, str]: ...

class InvalidQoSProfileException(Exception): ...

class QoSPolicyEnum(IntEnum):  # type: ignore[misc]
    @classmethod
    def short_keys(cls) -> list[str]: ...
    @classmethod
    def get_from_short_key(cls, name: str) -> Any: ...
    @property
    def short_key(self) -> str: ...

# RMW_... are the deprecated names.
class HistoryPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    KEEP_LAST = 1
    KEEP_ALL = 2
    UNKNOWN = 3
    RMW_QOS_POLICY_HISTORY_SYSTEM_DEFAULT = 0
    RMW_QOS_POLICY_HISTORY_KEEP_LAST = 1
    RMW_QOS_POLICY_HISTORY_KEEP_ALL = 2
    RMW_QOS_POLICY_HISTORY_UNKNOWN = 3

class ReliabilityPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    RELIABLE = 1
    BEST_EFFORT = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4
    RMW_QOS_POLICY_RELIABILITY_SYSTEM_DEFAULT = 0
    RMW_QOS_POLICY_RELIABILITY_RELIABLE = 1
    RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT = 2
    RMW_QOS_POLICY_RELIABILITY_UNKNOWN = 3

class DurabilityPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = 1
    VOLATILE = 2
    UNKNOWN = 3
    BEST_AVAILABLE = 4
    RMW_QOS_POLICY_DURABILITY_SYSTEM_DEFAULT = 0
    RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL = 1
    RMW_QOS_POLICY_DURABILITY_VOLATILE = 2
    RMW_QOS_POLICY_DURABILITY_UNKNOWN = 3

class LivelinessPolicy(QoSPolicyEnum):
    SYSTEM_DEFAULT = 0
    AUTOMATIC = 1
    MANUAL_BY_TOPIC = 3
    UNKNOWN = 4
    BEST_AVAILABLE = 5
    RMW_QOS_POLICY_LIVELINESS_SYSTEM_DEFAULT = 0
    RMW_QOS_POLICY_LIVELINESS_AUTOMATIC = 1
    RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC = 3
    RMW_QOS_POLICY_DURABILITY_UNKNOWN = 4

QoSHistoryPolicy = HistoryPolicy
QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSLivelinessPolicy = LivelinessPolicy

class QoSProfile:
    __hash__: ClassVar[None]  # type: ignore[assignment]
    # One of `history` and `depth` is required.
    def __init__(
        self,
        *,
        history: HistoryPolicy | int = ...,
        depth: int = ...,
        reliability: ReliabilityPolicy | int = ...,
        durability: DurabilityPolicy | int = ...,
        lifespan: Duration = ...,
        deadline: Duration = ...,
        liveliness: LivelinessPolicy | int = ...,
        liveliness_lease_duration: Duration = ...,
        avoid_ros_namespace_conventions: bool = ...,
    ) -> None: ...
    @property
    def history(self) -> HistoryPolicy: ...
    @history.setter
    def history(self, value: HistoryPolicy | int) -> None: ...
    @property
    def reliability(self) -> ReliabilityPolicy: ...
    @reliability.setter
    def reliability(self, value: ReliabilityPolicy | int) -> None: ...
    @property
    def durability(self) -> DurabilityPolicy: ...
    @durability.setter
    def durability(self, value: DurabilityPolicy | int) -> None: ...
    @property
    def liveliness(self) -> LivelinessPolicy: ...
    @liveliness.setter
    def liveliness(self, value: LivelinessPolicy | int) -> None: ...
    depth: int
    lifespan: Duration
    deadline: Duration
    liveliness_lease_duration: Duration
    avoid_ros_namespace_conventions: bool
    def get_c_qos_profile(self) -> Any: ...
    def __eq__(self, other: object) -> bool: ...

DeadlineBestAvailable: Duration
LivelinessLeaseDurationeBestAvailable: Duration

qos_profile_unknown: QoSProfile
qos_profile_default: QoSProfile
qos_profile_system_default: QoSProfile
qos_profile_sensor_data: QoSProfile
qos_profile_services_default: QoSProfile
qos_profile_parameters: QoSProfile
qos_profile_parameter_events: QoSProfile
qos_profile_best_available: QoSProfile
qos_profile_action_status_default: QoSProfile

class QoSPresetProfiles(Enum):
    _value_: QoSProfile
    UNKNOWN = ...
    DEFAULT = ...
    SYSTEM_DEFAULT = ...
    SENSOR_DATA = ...
    SERVICES_DEFAULT = ...
    PARAMETERS = ...
    PARAMETER_EVENTS = ...
    ACTION_STATUS_DEFAULT = ...
    BEST_AVAILABLE = ...
    @property
    def value(self) -> QoSProfile: ...
    @classmethod
    def short_keys(cls) -> list[str]: ...
    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile: ...
