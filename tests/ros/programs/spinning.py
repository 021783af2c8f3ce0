"""How the hand-written programs run their nodes: until Ctrl-C or SIGTERM, without a traceback."""

from __future__ import annotations

from contextlib import suppress

from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


def spin(*nodes: Node, executor: Executor | None = None) -> None:
    """Print ``ready``, and run the nodes until the process is to end."""
    executor = executor or SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()
