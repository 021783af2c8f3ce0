"""The example systems: topics, services, actions, generic node types, supervision, and robots."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any

import pytest
from composer_interfaces.action import Navigate
from geometry_msgs.msg import Point, PointStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from rclpy.qos import DurabilityPolicy, QoSPresetProfiles, QoSProfile
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger

from tests.ros.support.in_process import end_limit_s
from tests.ros.support.pipeline import NODES, check_the_drive, check_the_navigation
from tests.ros.support.system_process import REPOSITORY, ExternalNode, RunningSystem

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


#: The planner uses every tenth scan and comes up after the sensor, so it may miss the first scans.
PLANS = r"\[planner\] planning with scan [12]\d$"
FAILS = r"/sensor failed: silent for 1000 ms; restart 1 in 0\.5 s$"
DOWN = r"/sensor unconfigured$"
RESTART = (
    r"/sensor active$",
    r"/planner active$",
    r"/sensor is up again after restart 1$",
    r"\[planner\] planning with scan 1?\d$",
)
IN_ORDER = (
    *(PLANS, FAILS),
    *(r"/planner inactive$", r"/sensor inactive$", DOWN),
    *RESTART,
)
#: If the sensor has a process of its own, that takes it down at once, before the planner waits.
IN_ORDER_OVER_PROCESSES = (
    *(PLANS, DOWN, FAILS, r"/planner inactive$"),
    *RESTART,
)


def test_a_silent_sensor_is_restarted_and_the_planner_waits(external: ExternalNode) -> None:
    with RunningSystem("systems/supervised.yaml") as system:
        up_again = system.lines.index(system.wait_for("/sensor is up again after restart 1$"))
        external.spin_until(
            lambda: any(re.search(RESTART[-1], line) for line in system.lines[up_again:])
        )
        # Four seconds later the sensor is silent once more, and up again after another second.
        answers: list[Trigger.Response] = []
        external.spin_until(lambda: is_active(external, answers))
        assert answers[-1].message == "3 of 3 nodes active"
        code, took_s = system.stop()
    assert code == 0
    assert took_s < end_limit_s()
    is_split = "processes:" in system.path.read_text(encoding="utf-8")
    lines = iter(system.lines)
    for expected in IN_ORDER_OVER_PROCESSES if is_split else IN_ORDER:
        assert any(re.search(expected, line) for line in lines), expected
    camera = [line for line in system.lines if line.endswith("/camera inactive")]
    assert len(camera) == 2, "once during bring-up, once during tear-down"


def is_active(external: ExternalNode, answers: list[Trigger.Response]) -> bool:
    name = "/supervised/manager/is_active"
    answers.append(external.call(Trigger, name, Trigger.Request()))
    return bool(answers[-1].success)


def test_messages_arrive_in_process_and_externally(external: ExternalNode) -> None:
    received = external.listen(String, "/chatter")
    with RunningSystem("systems/talker_listener.yaml") as system:
        external.spin_until(lambda: len(received) >= 3)
        # In-process, no message is lost after the activation of the listener.
        first = int(system.wait_for(r"listener.*Received: Sensor reading \d+$").rpartition(" ")[2])
        for number in range(first, first + 3):
            system.wait_for(rf"listener.*Received: Sensor reading {number}$")
    assert first <= 5
    numbers = [int(message.data.removeprefix("Sensor reading ")) for message in received]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_talker_listener_is_short_and_without_python() -> None:
    text = (REPOSITORY / "systems" / "talker_listener.yaml").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 25
    assert "behavior" not in text


def test_a_late_joiner_receives_the_state_but_no_old_scans(external: ExternalNode) -> None:
    with RunningSystem("systems/qos_patterns.yaml") as system:
        external.wait_for_state("/robot", "active")
        system.wait_for(r"early_listener.*mode is ready")
        system.wait_for(r"early_listener.*order 1$")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        received = external.listen(String, "/mode", latched)
        external.spin_until(lambda: len(received) == 1)
        assert received[0].data == "ready"
        assert external.state("/late_joiner") == "unconfigured"
        assert external.change_state("/late_joiner", "configure")
        assert external.change_state("/late_joiner", "activate")
        system.wait_for(r"late_joiner.*mode is ready")
        first = system.wait_for(r"late_joiner.*scan \d+")
        # A best-effort subscription is compatible with a reliable publisher.
        system.wait_for(r"late_joiner.*order \d+")
    assert int(re.findall(r"scan (\d+)", first)[0]) > 5


def test_control_stays_on_one_thread_and_perception_uses_several(external: ExternalNode) -> None:
    cycles = external.listen(String, "/control/cycles")
    frames = external.listen(String, "/perception/processed", QoSPresetProfiles.SENSOR_DATA.value)
    with RunningSystem("systems/executors.yaml"):
        external.spin_until(
            lambda: (
                len(cycles) > 100
                and len({message.data.partition(":")[0] for message in frames}) > 1
            )
        )
    assert len({message.data for message in cycles}) == 1


def test_an_inline_node_uses_a_behavior_from_the_folder_of_node_types(tmp_path: Path) -> None:
    system = tmp_path / "systems" / "greeting.yaml"
    behavior = tmp_path / "nodes" / "greeter.py"
    system.parent.mkdir()
    behavior.parent.mkdir()
    system.write_text("system: greeting\nnodes:\n  hello: {behavior: 'greeter:Greeter'}\n", "utf-8")
    behavior.write_text(
        "class Greeter:\n    def on_activate(self):\n        self.log.info('good day')\n", "utf-8"
    )
    with RunningSystem(str(system)) as running:
        running.wait_for(r"hello.*good day")


SENSOR_DATA = QoSPresetProfiles.SENSOR_DATA.value


def test_the_robot_follows_the_planned_path(external: ExternalNode) -> None:
    commands = external.listen(Twist, "/motor_commands")
    odometry = external.listen(Odometry, "/sensor_data", SENSOR_DATA)
    # A straight path that is long enough for a slow discovery.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[6.0, 0.0]"):
        external.spin_until(lambda: bool(odometry) and odometry[-1].pose.pose.position.x > 5.9)
    check_the_drive(commands, odometry, line_m=0.0)


def test_an_external_node_navigates_and_cancels(external: ExternalNode) -> None:
    # Without waypoints the robot waits for goals.
    with RunningSystem("systems/pipeline.yaml", "--set", "motor_controller.waypoints=[]"):
        external.wait_for_state(NODES[-1], "active")
        check_the_navigation(external)


def test_the_robots_are_independent(external: ExternalNode) -> None:
    odometry = {
        robot: external.listen(Odometry, f"/{robot}/odometry", SENSOR_DATA)
        for robot in ("alpha", "beta")
    }
    # Each robot drives on its own line, so its position identifies it at any time.
    waypoints = ("alpha_controller.waypoints=[6.0, 0.0]", "beta_controller.waypoints=[6.0, 5.0]")
    options = [word for value in waypoints for word in ("--set", value)]
    with RunningSystem("systems/fleet.yaml", *options) as system:
        system.wait_for(r"9 of 9 nodes active")
        system.wait_for(r"alpha_controller.*driving to")
        system.wait_for(r"beta_controller.*driving to")
        external.spin_until(lambda: all(odometry.values()))
        code, _ = system.stop()
    assert code == 0
    for robot, line in (("alpha", 0.0), ("beta", 5.0)):
        assert all(abs(message.pose.pose.position.y - line) < 0.1 for message in odometry[robot])


def test_an_obstacle_is_found_on_the_map(external: ExternalNode) -> None:
    if os.environ.get("CI") != "true":
        pytest.importorskip("tf2_msgs", reason="make test builds it")
    found = external.listen(PointStamped, "/obstacles")
    with RunningSystem("systems/frames.yaml") as system:
        external.spin_until(lambda: len(found) >= 2)
        system.wait_for(r"obstacle_finder.*obstacle at x")
    for obstacle in found:
        assert obstacle.header.frame_id == "map"
        assert obstacle.point.z == pytest.approx(0.3)
        # The robot drives around this point, which is always 2 m to its left.
        distance_m = math.hypot(obstacle.point.x - 10.0, obstacle.point.y - 7.0)
        assert distance_m == pytest.approx(math.hypot(0.2, 1.5 - 2.0), abs=1e-3)
    assert found[0].point != found[1].point
