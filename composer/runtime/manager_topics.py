"""The manager's name and topics, for whoever publishes, listens or has to leave them alone."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile

NAME = "manager"
STATE_TOPIC = "state"
#: Transient local: who comes late gets the last one at once.
STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CALLBACKS_TOPIC = "callbacks"
CALLBACKS_QOS = QoSProfile(depth=1)
