"""The example services and actions, and the generic node types."""

from __future__ import annotations

from typing import Any

from composer_interfaces.action import Navigate
from geometry_msgs.msg import Point
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from tests.ros.support.system_process import ExternalNode, RunningSystem

SUCCEEDED = 4
STATE = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_a_client_gets_paths_failures_and_timeouts(external: ExternalNode) -> None:
    with RunningSystem("systems/trajectory_service.yaml") as system:
        system.wait_for(r"client.*True: 51 points")
        system.wait_for(r"client.*False: max_velocity must be above 0 m/s, not 0.0")
        system.wait_for(r"client.*no response: ")
        assert external.state("/client") == "active"


def test_goals_succeed_are_canceled_and_are_rejected(external: ExternalNode) -> None:
    topics = ("/clients/outcome", "/clients/hasty_outcome", "/clients/dreamer_outcome")
    outcomes = [external.listen(String, topic, STATE) for topic in topics]
    with RunningSystem("systems/navigation.yaml") as system:
        external.spin_until(lambda: all(outcomes))
        system.wait_for(r"patient.*100 % of the way")
        steps = [line for line in system.lines if "patient" in line and "% of the way" in line]
    assert [received[0].data for received in outcomes] == ["succeeded", "canceled", "rejected"]
    assert len(steps) == 10


def test_the_generic_node_types(external: ExternalNode) -> None:
    slow = external.listen(Float64, "/reading/slow")
    large = external.listen(Float64, "/reading/large")
    degrees = external.listen(String, "/reading/degrees")
    relayed = external.listen(Float64, "/reading/relayed")
    with RunningSystem("systems/toolbox.yaml"):
        # Counted from the same time on, as discovery times differ.
        external.spin_until(lambda: bool(relayed and slow))
        relayed.clear()
        slow.clear()
        external.spin_until(lambda: len(large) >= 5 and len(slow) >= 20)
        assert external.call(Trigger, "/trigger", Trigger.Request()).message == "request 0"
        assert external.call(Trigger, "/trigger", Trigger.Request()).message == "request 1"
        feedback, result = _navigate(external, Point(x=1.0))
    assert all(message.data > 1.0 for message in large)
    assert 2.0 < len(relayed) / len(slow) < 6.0  # 20 Hz in, 5 Hz out
    assert all(message.data.endswith(" degrees") for message in degrees)
    assert feedback == [10.0 * step for step in range(1, 11)]
    assert (result.status, result.result.message) == (SUCCEEDED, "arrived")


def _navigate(external: ExternalNode, target: Point) -> tuple[list[float], Any]:
    client = external.action_client(Navigate, "/navigate")
    feedback: list[float] = []
    goal = _send(external, client, target, feedback)
    # Request the result last, since rclpy then drops pending feedback.
    external.spin_until(lambda: len(feedback) == 10)
    result = external.result(goal.get_result_async())
    client.destroy()
    return feedback, result


def _send(
    external: ExternalNode, client: ActionClient, target: Point, feedback: list[float]
) -> Any:
    """Send a goal and return its handle once it is accepted."""
    goal = external.result(
        client.send_goal_async(
            Navigate.Goal(target=target, max_velocity=1.0),
            feedback_callback=lambda message: feedback.append(message.feedback.progress_percent),
        )
    )
    assert goal.accepted
    return goal
