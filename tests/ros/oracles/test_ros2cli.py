"""systems/pipeline.yaml and a hand-written pipeline, as the ``ros2`` command sees both.

Needs ROS 2 with ros2cli on PATH. ``DIFFERENCES`` decides where both may differ. Commands that only
read are repeated until both answers agree: discovery takes its time.
"""

from __future__ import annotations

import itertools
import os
import re
import shlex
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack
from functools import partial
from pathlib import Path

import pytest

from tests.ros.support.commands import hand_written, running

pytestmark = [
    pytest.mark.soak,
    pytest.mark.timeout(1200),
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
MANAGER = "/pipeline/manager"
#: By command, with the number of the time that it is run: what only the composed system answers.
#: Its manager is a node as well. It refuses an unknown transition; a node of rclpy ends with it.
DIFFERENCES = {
    "node list  # 1": MANAGER,
    "node list -c  # 1": "4",
    "topic list -t  # 1": MANAGER,
    "topic list --include-hidden-topics  # 1": MANAGER,
    "topic info -v /rosout  # 1": "Node name: manager",
    "service list -t  # 1": MANAGER,
    "param list  # 1": MANAGER,
    "node list  # 2": MANAGER,
    f"{NO_TRANSITION}  # 1": "success=False",
}
CHANGES = ("topic pub", "param set", "param delete", "lifecycle set", NO_TRANSITION)
#: They measure until Ctrl-C, and print a line with one of these from time to time.
ENDLESS = ("topic hz", "topic bw", "topic delay")
MEASUREMENT = ("average rate:", "/s from", "average delay:")
ENDS_WITHIN_S = 60.0
AGREES_WITHIN_S = 60.0
#: A command that has changed nothing, because it has not discovered the node.
NOT_DISCOVERED = ("Node not found", "Unable to find node")
WITHOUT_DISCOVERY = ("service call", "action send_goal", "topic pub", *ENDLESS)
DISCOVERY_S = (0.5, 1.0, 2.0, 4.0)


def test_the_tools_see_the_same(
    tmp_path: Path, in_a_domain: Callable[[], AbstractContextManager[int]]
) -> None:
    with ExitStack() as systems:
        pool = systems.enter_context(ThreadPoolExecutor(2))
        ids = [systems.enter_context(in_a_domain())]
        systems.enter_context(hand_written("hand_written_pipeline.py"))
        ids.append(systems.enter_context(in_a_domain()))
        systems.enter_context(running(tmp_path / "log", str(SYSTEM))).wait_for("nodes active after")
        lines = COMMANDS.strip().splitlines()
        reports = [
            _disagreement(line, f"{line}  # {lines[:number].count(line) + 1}", ids, pool)
            for number, line in enumerate(lines)
        ]
    assert not any(reports), "\n".join(reports)


def _disagreement(line: str, key: str, ids: Sequence[int], pool: ThreadPoolExecutor) -> str:
    """Return both answers to a command, if they do not agree in time; else nothing."""
    until_s = time.monotonic() + AGREES_WITHIN_S
    answers = ["", ""]
    pending = [0, 1]
    for number in itertools.count():
        spin_s = DISCOVERY_S[min(number, len(DISCOVERY_S) - 1)]
        answered = pool.map(partial(_answer, line, spin_s), [ids[side] for side in pending])
        for side, answer in zip(tuple(pending), answered, strict=True):
            answers[side] = answer
        expected, actual = answers
        if expected == actual if key not in DIFFERENCES else _differs(key, expected, actual):
            return ""
        if line.startswith(CHANGES):
            pending = [side for side in pending if any(map(answers[side].count, NOT_DISCOVERED))]
        if not pending or time.monotonic() > until_s:
            return f"===== {key}\n--- hand-written\n{expected}\n--- composed\n{actual}"
    raise AssertionError


def _differs(key: str, expected: str, actual: str) -> bool:
    """Return whether two answers differ as decided: all other lines without numbers are in both."""
    lost = set(expected.splitlines()) - set(actual.splitlines())
    marker = DIFFERENCES[key]
    return marker in actual and marker not in expected and all(map(re.compile(r".*\d").match, lost))


def _answer(line: str, spin_s: float, domain_id: int) -> str:
    words = shlex.split(line)
    if not line.startswith(WITHOUT_DISCOVERY):
        words += ("--no-daemon", "--spin-time", str(spin_s))
    with subprocess.Popen(
        ("ros2", *words),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain_id), "PYTHONUNBUFFERED": "1"},
    ) as process:
        limit = threading.Timer(ENDS_WITHIN_S, process.kill)
        limit.start()
        try:
            if line.startswith(ENDLESS):
                return _first_measurement(process)
            output, _ = process.communicate()
        finally:
            limit.cancel()
    # Tools that cannot run agree about everything.
    assert "Failed to load entry point" not in output, output
    return _without_chance(f"{output}exit code {process.returncode}")


def _first_measurement(process: subprocess.Popen[str]) -> str:
    """Return which line of a measurement comes first, and stop it as Ctrl-C does."""
    assert process.stdout is not None
    lines = (text for line in process.stdout for text in MEASUREMENT if text in line)
    measured = next(lines, "no measurement")
    process.send_signal(signal.SIGINT)
    process.communicate()
    return measured


def _without_chance(text: str) -> str:
    """Return the text without what differs from run to run."""
    text = text.replace("waiting for service to become available...\n", "")
    text = re.sub(r"(GID|ID): [\w.]+|(_ros2cli_)\d+", r"\1\2", text)
    text = re.sub(r"-?\d+\.\d+(e-?\d+)?|\d{15,}|(?<=sec[:=])\s*\d+", "#", text)
    text = re.sub(r"(publication_sequence_number:) \d+", r"\1 #", text)
    # The first feedback may arrive before the response that accepts the goal.
    feedback = re.compile(r"Feedback:\n(?:.+\n)+\n")
    return feedback.sub("", text) + "".join(feedback.findall(text)[:1])
