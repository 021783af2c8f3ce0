"""The other process of the tests of loops, in plain rclpy.

usage: loop_peer.py ROLE [ARGUMENT...]      its last line is the result, as JSON
"""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from composer_interfaces.action import Navigate
from rcl_interfaces.srv import GetParameters
from rclpy.action import ActionServer
from rclpy.action.server import CancelResponse, GoalResponse
from rclpy.node import Node
from std_msgs.msg import Int64
from std_srvs.srv import Trigger

PATIENCE_S = 60.0


def finished(node: Node, future: Any) -> Any:
    rclpy.spin_until_future_complete(node, future, timeout_sec=PATIENCE_S)
    assert future.done(), "no answer"
    return future.result()


def wait_until_known(node: Node) -> None:
    """Wait until the other process has discovered all entities of the node.

    Servers are discovered at once, but lose responses and feedback to clients that they have not
    discovered. Entities are announced in order, so a server that responds to the last client has
    discovered all of them.
    """
    client = node.create_client(GetParameters, "bench/get_parameters")
    assert client.wait_for_service(PATIENCE_S)
    until = time.monotonic() + PATIENCE_S
    answer = client.call_async(GetParameters.Request())
    while not answer.done():
        assert time.monotonic() < until, "never met"
        rclpy.spin_until_future_complete(node, answer, timeout_sec=1.0)
        if not answer.done():
            answer = client.call_async(GetParameters.Request())


def flood(node: Node, topic: str, count: str, depth: str) -> object:
    """Publish ``count`` numbers as fast as they go, as soon as someone listens.

    Stays until standard input closes, to send again what is lost.
    """
    publisher = node.create_publisher(Int64, topic, int(depth))
    until = time.monotonic() + PATIENCE_S
    while publisher.get_subscription_count() == 0:
        assert time.monotonic() < until, "no subscription"
        time.sleep(0.01)
    for number in range(int(count)):
        publisher.publish(Int64(data=number))
    sys.stdin.read()
    return int(count)


def call(node: Node, name: str, times: str) -> object:
    """Call a Trigger service ``times`` times at once."""
    client = node.create_client(Trigger, name)
    assert client.wait_for_service(PATIENCE_S)
    wait_until_known(node)
    futures = [client.call_async(Trigger.Request()) for _ in range(int(times))]
    return [[(answer := finished(node, future)).success, answer.message] for future in futures]


def navigate(node: Node, name: str) -> object:
    """Serve Navigate until killed: goals without velocity are rejected, slow ones go on and on."""

    def execute(goal: Any) -> Navigate.Result:
        for step in range(3 if goal.request.max_velocity >= 1.0 else 10_000):
            if goal.is_cancel_requested:
                goal.canceled()
                return Navigate.Result(message="canceled")
            goal.publish_feedback(Navigate.Feedback(progress_percent=float(step)))
            time.sleep(0.01)
        goal.succeed()
        return Navigate.Result(success=True, message="arrived")

    ActionServer(
        node,
        Navigate,
        name,
        execute,
        goal_callback=lambda goal: (
            GoalResponse.ACCEPT if goal.max_velocity > 0 else GoalResponse.REJECT
        ),
        cancel_callback=lambda _: CancelResponse.ACCEPT,
        callback_group=rclpy.callback_groups.ReentrantCallbackGroup(),
    )
    print("serving", flush=True)
    executor = rclpy.executors.MultiThreadedExecutor(2)
    executor.add_node(node)
    executor.spin()
    return GoalStatus.STATUS_UNKNOWN


ROLES = (flood, call, navigate)


def main() -> None:
    role = next(role for role in ROLES if role.__name__ == sys.argv[1])
    rclpy.init()
    seen = role(Node(f"peer_{os.getpid()}"), *sys.argv[2:])
    print(json.dumps(seen), flush=True)
    os._exit(0)  # nothing to clean up that the test is about


if __name__ == "__main__":
    main()
