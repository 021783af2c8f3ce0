from enum import IntEnum
from typing import Any

from rclpy.qos import QoSHistoryPolicy as QoSHistoryPolicy
from rclpy.qos import QoSPresetProfiles as QoSPresetProfiles
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.type_hash import TypeHash as TypeHash

class TopicEndpointTypeEnum(IntEnum):
    INVALID = 0
    PUBLISHER = 1
    SUBSCRIPTION = 2

class TopicEndpointInfo:
    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: TypeHash
    endpoint_type: TopicEndpointTypeEnum
    endpoint_gid: list[int]
    qos_profile: QoSProfile
    def __init__(self, **kwargs: Any) -> None: ...
    def __eq__(self, other: object) -> bool: ...
