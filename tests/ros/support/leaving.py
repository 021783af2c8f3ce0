"""How a hand-written node of a test leaves the ROS graph at once."""

from __future__ import annotations

from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node


def leave(node: Node) -> None:
    """Destroy a node with all that is of it.

    rclpy's ``destroy_node`` leaves actions out, and they keep the node, and that its participant,
    until the garbage collector comes by.
    """
    for waitable in list(node.waitables):
        if isinstance(waitable, (ActionClient, ActionServer)):
            waitable.destroy()
    node.destroy_node()
