"""Print the state of a lifecycle node, written with plain rclpy."""

from __future__ import annotations

import rclpy
from lifecycle_msgs.srv import GetState
from rclpy.node import Node


def main() -> None:
    """Print the state of the pipeline's planner."""
    rclpy.init()
    node = Node("get_state")
    client = node.create_client(GetState, "/planning/planner/get_state")
    if not client.wait_for_service(10.0):
        raise SystemExit("the service is not available")
    future = client.call_async(GetState.Request())
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    print(future.result().current_state.label)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
