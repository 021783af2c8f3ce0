"""The debugging commands on a system that ``compose run`` runs in another terminal."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
import yaml

from tests.ros.support.commands import PATIENCE_S, listed, running, said


@pytest.fixture(scope="module", autouse=True)
def pipeline(tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int) -> Iterator[None]:
    with running(tmp_path_factory.mktemp("pipeline") / "log.txt", "pipeline") as run:
        run.wait_for("3 of 3 nodes active")
        yield
        run.stop(signal.SIGTERM)


#: What a command line prints; they look only, so several may run side by side.
ANSWERS = {
    ("node", "list"): "/planning/planner\n",
    ("node", "info", "planner"): "  Subscribers:\n    /sensor_data:  nav_msgs/msg/Odometry\n",
    ("topic", "list", "-t"): "/sensor_data  ",
    ("topic", "echo", "/sensor_data", "--once", "--field", "header.frame_id"): "odom\n---\n",
    ("topic", "hz", "/sensor_data", "--count", "20"): "average rate: ",
    ("topic", "bw", "/sensor_data", "--count", "20"): "/s from 20 messages",
    ("service", "list"): "/plan_trajectory\n",
    ("service", "type", "/plan_trajectory"): "composer_interfaces/srv/PlanTrajectory\n",
    ("action", "list"): "/navigate\n",
    ("action", "info", "/navigate"): "Action servers: 1\n  /control/motor_controller\n",
    ("param", "list", "planner"): "max_velocity\n",
    ("param", "get", "planner", "max_velocity"): "1.0\n",
    ("param", "describe", "planner", "max_velocity"): "maximum:      5.0",
    ("param", "dump", "planner"): "/planning/planner:\n  ros__parameters:\n",
}


def test_every_command_that_looks_answers() -> None:
    with ThreadPoolExecutor(4) as pool:
        told = pool.map(answer, ANSWERS)
    for (arguments, expected), text in zip(ANSWERS.items(), told, strict=True):
        assert expected in text, arguments


def answer(arguments: tuple[str, ...]) -> str:
    """Ask, and ask again for what is listed: on a busy machine discovery outlasts a command."""
    patient = (*arguments, "--timeout", "20")
    if "list" not in arguments and "info" not in arguments:
        return said(*patient)
    return listed((ANSWERS[arguments],), *patient)


def test_a_goal_is_reached() -> None:
    goal = ("action", "send-goal", "/navigate", "{target: {x: 0.3}, max_velocity: 2.0}")
    told = [json.loads(line) for line in said(*goal, "--feedback", "--json").splitlines()]
    assert told[-1]["status"] == "succeeded"
    assert all(0.0 <= item["feedback"]["progress_percent"] <= 100.0 for item in told[:-1])


def test_a_parameter_is_set_and_a_message_published() -> None:
    command = ("param", "set", "motor_controller", "max_velocity", "0.5")
    assert said(*command) == "/control/motor_controller max_velocity: 0.5\n"
    once = ("topic", "pub", "--once", "--json", "/motor_commands", "geometry_msgs/msg/Twist")
    assert json.loads(said(*once, "{linear: {x: 0.1}}"))["linear"]["x"] == 0.1


def test_the_doctor_finds_no_fault() -> None:
    found = json.loads(said("doctor", "--json"))
    assert [item for item in found if item["level"] in ("warning", "error")] == []
    (graph,) = (item["message"] for item in found if item["area"] == "graph")
    assert graph.startswith("all ends fit: ")


def test_messages_are_fresh() -> None:
    until_s = time.monotonic() + PATIENCE_S
    while True:
        # It reports each second, too, which twenty messages may take longer than.
        told = said("topic", "delay", "/sensor_data", "--count", "20", "--json").splitlines()
        delay = json.loads(told[-1])
        # A command that gets no processor for a moment finds old messages afterwards.
        if delay["average_s"] < 0.1 or time.monotonic() > until_s:
            break
    assert 0.0 < delay["average_s"] < 0.1


def test_who_is_at_the_ends_and_what_is_offered() -> None:
    found = json.loads(said("topic", "info", "-v", "/sensor_data", "--json"))
    assert [end["node"] for end in found["publishers"]] == ["/perception/sensor_simulator"]
    assert [end["qos"]["reliability"] for end in found["subscriptions"]] == ["best_effort"] * 2


def test_a_service_answers_in_yaml() -> None:
    answer = yaml.safe_load(said("service", "call", "/plan_trajectory", "{max_velocity: 0.5}"))
    assert "success" in answer
