"""systems/pipeline.yaml and a hand-written pipeline, as the ``ros2`` command sees both.

Needs ROS 2 with ros2cli on PATH. ``DIFFERENCES`` decides where both may differ.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

import pytest

from tests.ros.support.commands import hand_written, running

pytestmark = [
    pytest.mark.soak,
    pytest.mark.timeout(1800),
    pytest.mark.skipif(shutil.which("ros2") is None, reason="the command ros2 is not installed"),
]
SYSTEM = Path(__file__).parents[3] / "systems" / "pipeline.yaml"
SENSOR, PLANNER, MOTOR = (
    "/perception/sensor_simulator",
    "/planning/planner",
    "/control/motor_controller",
)
PLAN = "service call /plan_trajectory composer_interfaces/srv/PlanTrajectory"
GOAL = "action send_goal /navigate composer_interfaces/action/Navigate"
NEAR = "'{target: {x: 0.1}, max_velocity: 1.0}'"
CHANGE_STATE = f"service call {PLANNER}/change_state lifecycle_msgs/srv/ChangeState"
NO_TRANSITION = CHANGE_STATE + " '{transition: {id: 99}}'"
COMMANDS = f"""
node list
node list -c
node info {SENSOR}
node info {PLANNER}
node info {MOTOR}
node info --include-hidden {MOTOR}
node info /nothing
topic list -t
topic list --include-hidden-topics
topic info /sensor_data
topic info -v /sensor_data
topic info -v /motor_commands
topic info -v /rosout
topic info -v {PLANNER}/transition_event
topic type /sensor_data
topic type /navigate/_action/feedback
topic find nav_msgs/msg/Odometry
topic find geometry_msgs/msg/Twist
topic echo --once /sensor_data
topic echo --once /sensor_data --no-arr --flow-style
topic echo --once /sensor_data --field header.frame_id
topic echo --once /motor_commands --csv
topic echo --once /motor_commands --filter m.linear.z==0
topic echo --once --include-message-info /motor_commands
topic echo --once --qos-reliability reliable --qos-durability volatile /motor_commands
topic hz --window 20 /sensor_data
topic bw /motor_commands
topic delay /sensor_data
topic pub --once /motor_commands geometry_msgs/msg/Twist {{}}
topic pub --once -w 2 /sensor_data nav_msgs/msg/Odometry {{}}
service list -t
service type /plan_trajectory
service type {PLANNER}/change_state
service type /nothing
service find composer_interfaces/srv/PlanTrajectory
service find lifecycle_msgs/srv/ChangeState
service info /plan_trajectory
{PLAN} '{{goal: {{x: 1.0}}, max_velocity: 0.5}}'
{PLAN} '{{goal: {{x: wrong}}}}'
service call {PLANNER}/get_state lifecycle_msgs/srv/GetState
service call {PLANNER}/get_available_states lifecycle_msgs/srv/GetAvailableStates
service call {PLANNER}/get_transition_graph lifecycle_msgs/srv/GetAvailableTransitions
service call {PLANNER}/list_parameters rcl_interfaces/srv/ListParameters
service call {PLANNER}/get_parameters rcl_interfaces/srv/GetParameters '{{names: [max_velocity]}}'
service call {PLANNER}/get_parameters rcl_interfaces/srv/GetParameters '{{names: [nothing]}}'
service call {PLANNER}/get_parameter_types rcl_interfaces/srv/GetParameterTypes '{{names: [x]}}'
action list -t
action type /navigate
action info -t /navigate
{GOAL} {NEAR}
{GOAL} {NEAR} --feedback
{GOAL} '{{target: wrong}}'
param list
param list {PLANNER} --param-type
param list {MOTOR} --param-prefixes max
param list --filter max {MOTOR}
param get {PLANNER} max_velocity
param get {MOTOR} waypoints
param get {PLANNER} nothing
param get /nothing max_velocity
param describe {PLANNER} max_velocity
param describe {PLANNER} nothing
param set {PLANNER} max_velocity 2.5
param get {PLANNER} max_velocity
param set {PLANNER} max_velocity 2
param set {PLANNER} max_velocity 9.5
param set {PLANNER} max_velocity fast
param set {PLANNER} nothing 1
param set {MOTOR} waypoints '[1.0, 0.0]'
param set {MOTOR} waypoints '[]'
param dump {PLANNER}
param delete {PLANNER} max_velocity
param delete {PLANNER} nothing
lifecycle nodes
lifecycle get {PLANNER}
lifecycle get
lifecycle list {PLANNER}
lifecycle list -a {PLANNER}
lifecycle set {PLANNER} activate
lifecycle set {PLANNER} nonsense
lifecycle set {MOTOR} deactivate
lifecycle get {MOTOR}
topic info -v /motor_commands
node info {MOTOR}
param set {MOTOR} position_gain 1.0
lifecycle set {MOTOR} cleanup
lifecycle list {MOTOR}
param set {MOTOR} position_gain 2.0
lifecycle set {MOTOR} configure
param get {MOTOR} position_gain
lifecycle set {MOTOR} activate
lifecycle get {MOTOR}
topic echo --once /motor_commands
lifecycle set {SENSOR} shutdown
lifecycle get {SENSOR}
lifecycle set {SENSOR} configure
node list
{NO_TRANSITION}
"""
MANAGER = "the manager of the system is a node as well"
#: By command, with the number of the time that it is run.
DIFFERENCES = {
    "node list  # 1": MANAGER,
    "node list -c  # 1": MANAGER,
    "topic list -t  # 1": MANAGER,
    "topic list --include-hidden-topics  # 1": MANAGER,
    "topic info -v /rosout  # 1": MANAGER,
    "service list -t  # 1": MANAGER,
    "param list  # 1": MANAGER,
    "node list  # 2": MANAGER,
    f"{NO_TRANSITION}  # 1": "an unknown transition is refused; a node of rclpy ends with it",
}
#: They measure until Ctrl-C, and print a line with one of these from time to time.
ENDLESS = ("topic hz", "topic bw", "topic delay")
MEASUREMENT = ("average rate:", "/s from", "average delay:")
ENDS_WITHIN_S = 60.0
#: A process that is not scheduled for a moment discovers the others late.
NOT_DISCOVERED = (
    "Node not found",
    "Unable to find node",
    "Unknown service",
    "does not appear to be published yet",
)
ATTEMPTS = 3
DISCOVERY = ("--no-daemon", "--spin-time", "2")
WITHOUT_DISCOVERY = ("service call", "action send_goal", "topic pub", *ENDLESS)


def test_the_tools_see_the_same(
    tmp_path: Path, in_a_domain: Callable[[], AbstractContextManager[int]]
) -> None:
    with ExitStack() as systems:
        ids = [systems.enter_context(in_a_domain())]
        systems.enter_context(hand_written("hand_written_pipeline.py"))
        ids.append(systems.enter_context(in_a_domain()))
        systems.enter_context(running(tmp_path / "log", str(SYSTEM))).wait_for("nodes active after")
        with ThreadPoolExecutor() as pool:
            expected, actual = pool.map(_answers, ids)
    differing = {command for command in expected if expected[command] != actual[command]}
    report = (
        f"===== {command}\n--- hand-written\n{expected[command]}\n--- composed\n{actual[command]}"
        for command in expected
        if command in differing
    )
    assert differing == DIFFERENCES.keys(), "\n".join(report)


def _answers(domain_id: int) -> dict[str, str]:
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain_id)}
    lines = COMMANDS.strip().splitlines()
    numbered = (f"{line}  # {lines[:number].count(line) + 1}" for number, line in enumerate(lines))
    return {key: _answer(line, environment) for key, line in zip(numbered, lines, strict=True)}


def _answer(line: str, environment: Mapping[str, str]) -> str:
    words = shlex.split(line)
    if not line.startswith(WITHOUT_DISCOVERY):
        words += DISCOVERY
    for _ in range(ATTEMPTS):
        answer = _output(words, environment, is_endless=line.startswith(ENDLESS))
        if not any(text in answer for text in NOT_DISCOVERED):
            break
    return _without_chance(answer)


def _output(words: Sequence[str], environment: Mapping[str, str], *, is_endless: bool) -> str:
    with subprocess.Popen(
        ("ros2", *words),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**environment, "PYTHONUNBUFFERED": "1"},
    ) as process:
        limit = threading.Timer(ENDS_WITHIN_S, process.kill)
        limit.start()
        try:
            if is_endless:
                return _first_measurement(process)
            output, _ = process.communicate()
        finally:
            limit.cancel()
    return f"{output}exit code {process.returncode}"


def _first_measurement(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    lines = (text for line in process.stdout for text in MEASUREMENT if text in line)
    found = next(lines, "no measurement")
    process.kill()
    return found


def _without_chance(text: str) -> str:
    """Return the text without what differs from run to run."""
    text = text.replace("waiting for service to become available...\n", "")
    text = re.sub(r"(GID|ID): [\w.]+|(_ros2cli_)\d+", r"\1\2", text)
    text = re.sub(r"-?\d+\.\d+(e-?\d+)?|\d{15,}|(?<=sec[:=])\s*\d+", "#", text)
    text = re.sub(r"(publication_sequence_number:) \d+", r"\1 #", text)
    # The first feedback may arrive before the response that accepts the goal.
    feedback = re.compile(r"Feedback:\n(?:.+\n)+\n")
    return feedback.sub("", text) + "".join(feedback.findall(text)[:1])
