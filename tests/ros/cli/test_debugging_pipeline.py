"""The commands for the ROS graph, with a system that runs in another process."""

from __future__ import annotations

import json
import re
import signal
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import yaml
from std_msgs.msg import String

from composer.remote.graph_names import GraphNames
from composer.remote.session import Deadline, Session
from composer.remote.systems.local_graph import local_names
from composer.remote.systems.local_queries import (
    local_action,
    local_node,
    local_parameters,
    local_report,
    local_reports,
    local_topic,
)
from composer.runtime.process.query_socket import KINDS
from tests.ros.support.commands import PATIENCE_S, compose, hand_written, listed, output_of, running
from tests.ros.support.in_process import Peer, wait_until


@pytest.fixture(scope="module", autouse=True)
def pipeline(tmp_path_factory: pytest.TempPathFactory, shared_domain_id: int) -> Iterator[None]:
    with running(tmp_path_factory.mktemp("pipeline") / "log.txt", "pipeline") as run:
        run.wait_for("3 of 3 nodes active")
        yield
        run.stop(signal.SIGTERM)


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """A session with the discovery range of the system."""
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with Session() as session:
        yield session


#: Commands that a running system answers, and one that it leaves to the ROS graph.
ANSWERED = (
    ("ps",),
    ("ps", "pipeline"),
    ("lifecycle", "nodes"),
    ("lifecycle", "get", "planner"),
    ("node", "info", "planner"),
    ("node", "info", "planner", "--include-hidden"),
    ("topic", "info", "-v", "sensor_data"),
    ("topic", "info", "/rosout", "--json"),
    ("topic", "info", "/sensor_dat"),
    ("action", "info", "/navigate"),
    ("action", "info", "navigate", "--json"),
    ("action", "info", "/navigat"),
    ("param", "list", "--param-type"),
    ("param", "list", "planner", "--json"),
    ("param", "get", "motor_controller", "waypoints"),
    ("param", "describe", "planner", "max_velocity", "use_sim_time"),
    ("param", "dump", "/pipeline/manager"),
    ("param", "get", "planner", "max_velocit"),
)


def without_figures(text: str) -> str:
    """Hide rates, durations with their units, and the widths of columns, which depend on them."""
    return re.sub(" +", " ", re.sub(r"\d+\.?\d*( *\b(s|min)\b)?", " 0 ", text))


def test_a_running_system_answers_as_the_graph_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    wait_until(lambda: local_reports(PATIENCE_S), "the reports")
    planner = local_parameters("planner", PATIENCE_S)
    assert planner is not None
    assert planner.values(["max_velocity"]) == {"max_velocity": 1.0}
    assert local_node("planner", PATIENCE_S, hidden=False)
    wait_until(lambda: local_topic("sensor_data", PATIENCE_S), "the endpoints of a topic")
    wait_until(lambda: local_action("navigate", PATIENCE_S), "the nodes of an action")
    with ThreadPoolExecutor(4) as pool:
        from_system = list(pool.map(lambda words: compose(*words), ANSWERED))
        timed = local_report("pipeline", PATIENCE_S, callbacks=True)
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # as if the system ran elsewhere
        from_graph = list(pool.map(lambda words: compose(*words), ANSWERED))
        (system,) = json.loads(output_of("ps", "--json"))["systems"]
    expected_callbacks = {item["name"] for node in system["nodes"] for item in node["callbacks"]}
    assert timed is not None
    assert {item.name for item in timed.callbacks} == expected_callbacks
    for words, found, expected in zip(ANSWERED, from_system, from_graph, strict=True):
        assert without_figures(found.stdout) == without_figures(expected.stdout), words
        assert found.stderr == expected.stderr, words
        assert found.returncode == expected.returncode, words


def test_the_manager_sees_the_same_graph_as_a_new_node(session: Session, peer: Peer) -> None:
    peer.node.create_publisher(String, "/of_an_external_node", 10)
    names = GraphNames(session, Deadline(PATIENCE_S))
    topic = ("/of_an_external_node", ("std_msgs/msg/String",))
    # A command of another test may still be there.
    wait_until(lambda: topic in (local_names("topic", PATIENCE_S) or ()), "the view of the manager")
    session.wait_for(lambda: topic in names.names("topic") or None, Deadline(PATIENCE_S))
    for kind in KINDS:
        for hidden in (False, True):
            expected = names.names(kind, hidden=hidden)
            wait_until(
                lambda: local_names(kind, PATIENCE_S, hidden=hidden) == expected,  # noqa: B023
                f"each {kind}",
            )
    assert "/pipeline/manager" in dict(local_names("node", PATIENCE_S) or ())


def test_a_killed_process_is_not_listed(session: Session) -> None:
    with hand_written("hand_written_forgetful.py"):
        wait_until(lambda: "/lab/forgetful" in dict(local_names("node", PATIENCE_S) or ()))
    assert "/lab/forgetful" not in dict(local_names("node", PATIENCE_S) or ())


#: Part of the output of each command; they only read, so they can run in parallel.
OUTPUTS = {
    ("node", "list"): "/planning/planner\n",
    ("node", "info", "planner"): "  Subscribers:\n    /sensor_data:  nav_msgs/msg/Odometry\n",
    ("topic", "list", "-t"): "/sensor_data  ",
    ("topic", "echo", "/sensor_data", "--once", "--field", "header.frame_id"): "odom\n---\n",
    ("topic", "echo", "/sensor_data", "--once", "--field", "pose.covariance[0]"): "0.0\n---\n",
    ("topic", "echo", "/sensor_data", "--once", "--raw"): r"\x00\x01\x00\x00",
    ("topic", "list", "--include-hidden-topics"): "/navigate/_action/feedback\n",
    ("topic", "type", "sensor_data"): "nav_msgs/msg/Odometry\n",
    ("topic", "find", "nav_msgs/msg/Odometry"): "/sensor_data\n",
    ("topic", "info", "-v", "/sensor_data"): "  type hash: RIHS01_",
    ("topic", "hz", "/sensor_data", "--count", "20"): "average rate: ",
    ("topic", "bw", "/sensor_data", "--count", "20"): "/s from 20 messages",
    ("service", "list"): "/plan_trajectory\n",
    ("service", "type", "/plan_trajectory"): "composer_interfaces/srv/PlanTrajectory\n",
    ("service", "find", "composer_interfaces/srv/PlanTrajectory"): "/plan_trajectory\n",
    ("action", "list"): "/navigate\n",
    ("action", "type", "/navigate"): "composer_interfaces/action/Navigate\n",
    ("action", "find", "composer_interfaces/action/Navigate", "--count"): "1\n",
    ("action", "info", "/navigate"): "Action servers: 1\n  /control/motor_controller\n",
    ("param", "list", "planner"): "max_velocity\n",
    ("param", "list", "planner", "--param-type"): "max_velocity (type: double)\n",
    ("param", "get", "planner", "max_velocity"): "1.0\n",
    ("param", "describe", "planner", "max_velocity"): "maximum:      5.0",
    ("param", "dump", "planner"): "/planning/planner:\n  ros__parameters:\n",
}


def test_commands_that_read() -> None:
    with ThreadPoolExecutor(4) as pool:
        texts = pool.map(retried_output, OUTPUTS)
    for (arguments, expected), text in zip(OUTPUTS.items(), texts, strict=True):
        assert expected in text, arguments


def retried_output(arguments: tuple[str, ...]) -> str:
    """Return the output; retry lists, because discovery may take longer on a busy machine."""
    patient = (*arguments, "--timeout", "20")
    if "list" not in arguments and "info" not in arguments:
        return output_of(*patient)
    return listed((OUTPUTS[arguments],), *patient)


def test_a_goal_is_reached() -> None:
    goal = ("action", "send-goal", "/navigate", "{target: {x: 0.3}, max_velocity: 2.0}")
    printed = [json.loads(line) for line in output_of(*goal, "--feedback", "--json").splitlines()]
    assert printed[-1]["status"] == "succeeded"
    assert all(0.0 <= item["feedback"]["progress_percent"] <= 100.0 for item in printed[:-1])


def test_a_parameter_is_set_and_a_message_published() -> None:
    command = ("param", "set", "motor_controller", "max_velocity", "0.5")
    assert output_of(*command) == "/control/motor_controller max_velocity: 0.5\n"
    once = ("topic", "pub", "--once", "--json", "/motor_commands", "geometry_msgs/msg/Twist")
    assert json.loads(output_of(*once, "{linear: {x: 0.1}}"))["linear"]["x"] == 0.1


def test_doctor_reports_no_problems() -> None:
    found = json.loads(output_of("doctor", "--json"))
    assert [item for item in found if item["level"] in ("warning", "error")] == []
    (graph,) = (item["message"] for item in found if item["area"] == "graph")
    assert graph.startswith("all endpoints are compatible: ")


def test_messages_are_fresh() -> None:
    until_s = time.monotonic() + PATIENCE_S
    while True:
        # Twenty messages may take longer than a second, then there is more than one report.
        reports = output_of(
            "topic", "delay", "/sensor_data", "--count", "20", "--json"
        ).splitlines()
        delay = json.loads(reports[-1])
        # A command that is not scheduled for a moment receives old messages afterwards.
        if delay["average_s"] < 0.1 or time.monotonic() > until_s:
            break
    assert 0.0 < delay["average_s"] < 0.1


def test_topic_info() -> None:
    found = json.loads(output_of("topic", "info", "-v", "/sensor_data", "--json"))
    assert [item["node"] for item in found["publishers"]] == ["/perception/sensor_simulator"]
    assert [item["qos"]["reliability"] for item in found["subscriptions"]] == ["best_effort"] * 2


def test_a_response_is_printed_as_yaml() -> None:
    response = yaml.safe_load(
        output_of("service", "call", "/plan_trajectory", "{max_velocity: 0.5}")
    )
    assert "success" in response
