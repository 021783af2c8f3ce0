from typing import TypeVar

from rclpy.node import Node as Node
from rclpy.qos import QoSProfile as QoSProfile
from rclpy.signals import SignalHandlerGuardCondition as SignalHandlerGuardCondition
from rclpy.utilities import timeout_sec_to_nsec as timeout_sec_to_nsec

_T = TypeVar("_T")

# With False there is no message, which is not declared, as for `Future.result`.
def wait_for_message(
    msg_type: type[_T],
    node: Node,
    topic: str,
    *,
    qos_profile: QoSProfile | int = 1,
    time_to_wait: float = -1,
) -> tuple[bool, _T]: ...
