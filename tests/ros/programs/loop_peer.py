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
from rclpy.action import ActionClient, ActionServer
from rclpy.action.server import CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Int64, String
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
    while publisher.get_subscription_count() == 0 and time.monotonic() < until:
        time.sleep(0.01)
    for number in range(int(count)):
        publisher.publish(Int64(data=number))
    sys.stdin.read()
    return int(count)


def collect(node: Node, topic: str, count: str) -> object:
    """Subscribe and return the first ``count`` texts."""
    seen: list[str] = []
    node.create_subscription(String, topic, lambda message: seen.append(message.data), 1000)
    until = time.monotonic() + PATIENCE_S
    while len(seen) < int(count) and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.1)
    return seen


def latched(node: Node, topic: str, text: str) -> object:
    """Publish one transient-local message and stay until standard input closes."""
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(String, topic, qos).publish(String(data=text))
    print("published", flush=True)
    sys.stdin.read()
    return text


def call(node: Node, name: str, times: str) -> object:
    """Call a Trigger service ``times`` times at once."""
    client = node.create_client(Trigger, name)
    assert client.wait_for_service(PATIENCE_S)
    wait_until_known(node)
    futures = [client.call_async(Trigger.Request()) for _ in range(int(times))]
    return [[(answer := finished(node, future)).success, answer.message] for future in futures]


def serve(node: Node, name: str) -> object:
    """Serve a Trigger service until killed."""

    def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        response.message = "from the peer"
        return response

    node.create_service(Trigger, name, answer)
    print("serving", flush=True)
    rclpy.spin(node)
    return None


def send_goal(node: Node, name: str, max_velocity: str, cancel: str) -> object:
    """Send a Navigate goal; with ``cancel``, cancel it after the first feedback."""
    client = ActionClient(node, Navigate, name)
    assert client.wait_for_server(PATIENCE_S)
    wait_until_known(node)
    seen: list[float] = []
    handle = finished(
        node,
        client.send_goal_async(
            Navigate.Goal(max_velocity=float(max_velocity)),
            feedback_callback=lambda message: seen.append(message.feedback.progress_percent),
        ),
    )
    if not handle.accepted:
        return {"accepted": False}
    # Once it has the result, rclpy drops the feedback that is still to be taken.
    until = time.monotonic() + PATIENCE_S
    while len(seen) < (1 if cancel else 3) and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.1)
    canceling = 0
    if cancel == "cancel":
        canceling = len(finished(node, handle.cancel_goal_async()).goals_canceling)
    end = finished(node, handle.get_result_async())
    return {
        "accepted": True,
        "canceling": canceling,
        "status": end.status,
        "message": end.result.message,
        "feedback": seen,
    }


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


ROLES = (flood, collect, latched, call, serve, send_goal, navigate)


def main() -> None:
    role = next(role for role in ROLES if role.__name__ == sys.argv[1])
    rclpy.init()
    seen = role(Node(f"peer_{os.getpid()}"), *sys.argv[2:])
    print(json.dumps(seen), flush=True)
    os._exit(0)  # nothing to clean up that the test is about


if __name__ == "__main__":
    main()
