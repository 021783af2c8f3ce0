"""The name, services and topics of the manager node, for the manager and its clients.

Commands import this and not the manager, whose imports include the whole runtime.
"""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile

NAME = "manager"

#: Services: std_srvs/srv/Trigger; ChangeState for nodes without lifecycle services.
IS_ACTIVE = "is_active"
CHANGE_STATE = "change_state"
#: rcl_interfaces/srv/SetParametersAtomically, with the full names of nodes in the parameter
#: ``nodes``: the only standard service that takes names and returns a reason.
RESTART = "restart"
RESTART_NODES = "nodes"
#: A hidden service of each manager, with a unique name: see ``manager/other_instances.py``.
INSTANCE_PREFIX = "_instance_"

STATE_TOPIC = "state"
#: Transient local: a late joiner gets the last message at once.
STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CALLBACKS_TOPIC = "callbacks"
CALLBACKS_QOS = QoSProfile(depth=10)


def full_parameter_name(node: str, parameter: str) -> str:
    """Return the manager's name of a node's parameter: node names have no dots."""
    return f"{node}.{parameter}"
