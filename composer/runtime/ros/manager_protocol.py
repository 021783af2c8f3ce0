"""What a manager node is called and what it offers, for both ends: whoever serves and whoever asks.

Commands import this and not the manager, which brings with it all that runs nodes.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile

NAME = "manager"

#: Services: std_srvs/srv/Trigger, and for nodes without services of their own ChangeState.
IS_ACTIVE = "is_active"
CHANGE_STATE = "change_state"

STATE_TOPIC = "state"
#: Transient local: who comes late gets the last one at once.
STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CALLBACKS_TOPIC = "callbacks"
CALLBACKS_QOS = QoSProfile(depth=1)


def full_parameter_name(node: str, parameter: str) -> str:
    """Return what a node's parameter is called at the manager: node names have no dots."""
    return f"{node}.{parameter}"
