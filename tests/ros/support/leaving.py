"""Destroys a hand-written node of a test, with its actions."""

from __future__ import annotations

from rclpy.action import ActionClient, ActionServer
from rclpy.node import Node


def leave(node: Node) -> None:
    """Destroy a node with its actions.

    rclpy's ``destroy_node`` does not destroy actions, which keep the node and its participant until
    a garbage collection.
    """
    for waitable in list(node.waitables):
        if isinstance(waitable, (ActionClient, ActionServer)):
            waitable.destroy()
    node.destroy_node()
