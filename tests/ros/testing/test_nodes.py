"""The behaviors in nodes/, each alone: what users see first of how tests look."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from composer.testing import BehaviorTest

NODES = Path(__file__).parents[3] / "nodes"

Open = Callable[..., BehaviorTest]


@pytest.mark.parametrize(
    ("fields", "success", "message"),
    [
        ({"goal": {"x": 2.0}, "max_velocity": 1.0}, True, "21 points"),
        ({"goal": {"x": 2.0}, "max_velocity": 9.0}, True, "11 points"),
        ({"max_velocity": 1.0}, True, "2 points"),
        ({"max_velocity": 0.0}, False, "max_velocity must be above 0 m/s, not 0.0"),
        ({"goal": {"x": float("inf")}, "max_velocity": 1.0}, False, "goal must be finite"),
        ({"goal": {"x": 1.0}, "max_velocity": 1e-300}, False, "more than 10000 points"),
    ],
)
def test_the_planner_samples_a_line(
    behavior_test: Open, fields: dict[str, Any], success: bool, message: str
) -> None:
    planner = behavior_test(NODES / "planner.yaml", parameters={"max_velocity": 2.0})
    planner.send("sensor_data", {"header": {"frame_id": "odom"}})
    response = planner.call("plan_trajectory", fields)
    assert response.success == success
    assert message in response.message


def test_the_simulator_brakes_without_commands(behavior_test: Open) -> None:
    robot = behavior_test(NODES / "sensor_simulator.yaml", parameters={"max_acceleration": 10.0})
    robot.send("motor_commands", {"linear": {"x": 1.0}})
    robot.advance(0.5)
    assert robot.messages("sensor_data")[-1].message.twist.twist.linear.x == 1.0
    robot.advance(0.2)
    assert robot.messages("sensor_data")[-1].message.twist.twist.linear.x == 0.0


def test_the_controller_drives_along_a_planned_path(behavior_test: Open) -> None:
    """The test is the robot, and another node type the planner."""
    planner = behavior_test(NODES / "planner.yaml")
    planner.send("sensor_data", {"header": {"frame_id": "odom"}})
    controller = behavior_test(NODES / "motor_controller.yaml", parameters={"waypoints": []})
    controller.answer("plan_trajectory", lambda request: planner.call("plan_trajectory", request))
    x = 0.0
    controller.send("sensor_data")
    goal = controller.send_goal("navigate", {"target": {"x": 1.0}, "max_velocity": 1.0})
    while x < 0.98:
        controller.advance(0.1)
        planner.advance(0.1)
        x += 0.1 * controller.messages("motor_commands")[-1].message.linear.x
        controller.send("sensor_data", {"pose": {"pose": {"position": {"x": x}}}})
        assert controller.now_s < 5.0
    assert goal.result().status == "succeeded"
    percents = [item.progress_percent for item in goal.feedback]
    assert percents == sorted(percents)
    assert controller.calls("plan_trajectory")[0].message.max_velocity == 0.8


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [
        ({"answer": {"message": "arrived"}, "after_s": 2.0}, "succeeded"),
        ({"answer": lambda goal: goal.abort()}, "aborted"),
        ({"accept": False}, "rejected"),
        (None, "failed"),
    ],
)
def test_the_client_publishes_the_outcome(
    behavior_test: Open, answer: dict[str, Any] | None, outcome: str
) -> None:
    client = behavior_test(NODES / "navigate_client.yaml")
    if answer is not None:
        client.answer("navigate", **answer)
    client.run_until(lambda: client.messages("outcome"), 10.0)
    assert client.messages("outcome")[0].message.data == outcome


def test_threads_and_reentrant_timers(behavior_test: Open) -> None:
    loop = behavior_test(NODES / "control_loop.yaml")
    frames = behavior_test(NODES / "frame_processor.yaml", parameters={"frame_bytes": 1000})
    loop.advance(0.1)
    frames.advance(1.0)
    assert {item.message.data for item in loop.messages("cycles")} == {"MainThread"}
    assert frames.messages("processed")[0].message.data.endswith(" bytes")
