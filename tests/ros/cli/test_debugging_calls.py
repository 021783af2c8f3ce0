"""Services, actions, parameters and wrong names in commands, with a plain rclpy node."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.ros.support.commands import (
    PATIENCE_S,
    compose,
    error,
    errors,
    expect_error,
    expect_errors,
    finished,
    listed,
    repeated,
    repeated_until,
    start,
)

pytestmark = pytest.mark.usefixtures("talker")


def test_services() -> None:
    assert "/lab/add" in listed(("/lab/add\n",), "service", "list").split()
    kind = "std_srvs/srv/SetBool"
    listed((kind,), "service", "list", "-t")
    response = {"success": True, "message": "switched"}
    call = ("service", "call", "/lab/add")
    assert yaml.safe_load(listed(("switched",), *call, "{data: true}")) == response
    typed = listed(("switched",), *call, kind, "{data: true}", "--json")
    assert json.loads(typed) == response
    expect_error("SetBool_Request has no field 'dta'", *call, "{dta: 1}")
    expect_error("did you mean '/lab/add'?", "service", "call", "/lab/ad", "{data: true}")
    gone = ("service", "call", "/lab/gone", "std_srvs/srv/SetBool", "{}", "--timeout", "0.5")
    assert "no server of service '/lab/gone' found within 0.5 s" in error(*gone)


def test_actions() -> None:
    assert listed(("/lab/navigate",), "action", "list", "-t").split() == [
        "/lab/navigate",
        "composer_interfaces/action/Navigate",
    ]
    info = json.loads(listed(("/lab/talker",), "action", "info", "/lab/navigate", "--json"))
    assert info["servers"] == ["/lab/talker"]
    relative = listed(("/lab/talker",), "action", "info", "lab/navigate", "--json")
    assert json.loads(relative) == info


NAVIGATE = ("action", "send-goal", "/lab/navigate")
ENDLESS = (*NAVIGATE, "{max_velocity: -1}", "--json")


def test_a_goal_prints_feedback_and_the_result() -> None:
    goal = (*NAVIGATE, "{max_velocity: 1.0}", "--feedback", "--json")
    # The first feedback may be sent before the subscription is matched.
    text = repeated_until(lambda text: text.count('"feedback"') == 3, *goal)
    check_goal([json.loads(line) for line in text.splitlines()])
    # Feedback that arrives with the result is printed as well.
    process = start(*goal, "--timeout", "20")
    assert process.stdout is not None
    first = json.loads(next(line for line in process.stdout if "feedback" in line))
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.5)  # the talker sends the rest and ends the goal
    process.send_signal(signal.SIGCONT)
    printed = [first, *map(json.loads, process.stdout)]
    finished(process)
    check_goal(printed)


def check_goal(printed: list[dict[str, Any]]) -> None:
    *feedback, last = printed
    assert [item["feedback"]["progress_percent"] for item in feedback] == [0.0, 1.0, 2.0]
    assert (last["status"], last["result"]["distance_traveled"]) == ("succeeded", 2.5)


def test_goals_are_rejected_and_canceled() -> None:
    kind = "composer_interfaces/action/Navigate"
    expect_error("'/lab/navigate' rejected the goal", *NAVIGATE, kind, "{}")
    limit = ("--result-timeout", "0.3")
    done = repeated(lambda done: "canceled" in done.stdout, *ENDLESS, *limit)
    assert done.returncode == 1, done.stderr
    assert json.loads(done.stdout)["status"] == "canceled"
    process = start(*ENDLESS, "--feedback", "--timeout", "20")
    assert process.stdout is not None
    assert any("feedback" in line for line in process.stdout)
    process.send_signal(signal.SIGINT)
    rest, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 1
    last = json.loads(rest.splitlines()[-1])
    assert (last["status"], last["result"]["message"]) == ("canceled", "stopped")
    assert "canceling" in err
    assert "Traceback" not in err


def value_of(name: str) -> Any:
    """Return the value of a parameter of the talker."""
    return json.loads(listed(("\n",), "param", "get", "/lab/talker", name, "--json"))


def test_parameters_can_be_read_and_set() -> None:
    names = ("speed", "name", "gains")
    assert set(names) <= set(listed(names, "param", "list", "talker").split())
    assert listed(("1",), "param", "get", "talker", "speed") == "1.5\n"
    setting = ("param", "set", "talker")
    assert listed(("speed",), *setting, "speed", "2e0") == "/lab/talker speed: 2.0\n"
    assert value_of("speed") == 2.0
    assert json.loads(listed(("name",), *setting, "name", "123", "--json")) == {
        "/lab/talker": {"ros__parameters": {"name": "123"}}
    }
    assert value_of("name") == "123"
    listed(("gains",), *setting, "gains", "[3, 4.5]")
    assert value_of("gains") == [3.0, 4.5]


def test_rejected_parameters_are_reported_with_the_reason() -> None:
    setting = ("param", "set", "talker")
    text = compose(*setting, "gains", "[3").stderr
    assert text == "compose: '[3' is not YAML: expected ',' or ']', but got '<stream end>'\n"
    large = f"[{2**63}]"
    expect_errors(
        ("out of range", *setting, "speed", "-99"),
        ("parameter 'speed' has type double, got 'fast'", *setting, "speed", "fast"),
        (f"parameter 'counts' has type integer_array, got {large}", *setting, "counts", large),
        ("did you mean 'speed'?", *setting, "sped", "1"),
        ("did you mean '/lab/talker'?", "param", "list", "taker"),
    )


def test_a_call_is_repeated_until_ctrl_c() -> None:
    call = ("service", "call", "/lab/add", "std_srvs/srv/SetBool", "{data: true}")
    process = start(*call, "-r", "20", "--json", "--timeout", "20")
    assert process.stdout is not None
    responses = [json.loads(process.stdout.readline()) for _ in range(3)]
    assert responses == [{"success": True, "message": "switched"}] * 3
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130


def test_parameters_are_listed_and_described() -> None:
    describe = ("param", "describe", "talker", "speed")
    speed = json.loads(listed(("speed",), *describe, "--json"))
    assert speed == {
        "name": "speed",
        "type": "double",
        "description": "How fast.",
        "minimum": 0.0,
        "maximum": 5.0,
    }
    several = json.loads(listed(("speed",), *describe, "name", "--json"))
    assert [item["name"] for item in several] == ["speed", "name"]
    everything = json.loads(listed(("/lab/talker",), "param", "list", "--json"))
    assert {"speed", "name", "gains"} <= set(everything["/lab/talker"])
    listed(("/lab/talker:\n",), "param", "list")


def test_a_dump_can_be_loaded(tmp_path: Path) -> None:
    file = tmp_path / "talker.yaml"
    dumped = yaml.safe_load(listed(("speed",), "param", "dump", "talker"))
    values = dumped["/lab/talker"]["ros__parameters"]
    assert values["start_type_description_service"] is True  # read-only, as in every ROS node
    values.update(speed=0.25, name="loaded")
    file.write_text(yaml.safe_dump(dumped))
    loaded = json.loads(listed(("speed",), "param", "load", "talker", str(file), "--json"))
    del values["start_type_description_service"]
    assert loaded == dumped
    assert value_of("speed") == 0.25


def test_parameter_files_can_nest_names_and_use_wildcards(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(
        "/**: {ros__parameters: {speed: 2, speed: 1, for_others: off}}\n"
        "lab: {talker: {ros__parameters: {limits: {reach: 2}}}}\n"
    )
    load = ("param", "load", "talker", str(file))
    assert listed(("speed",), *load) == ("/lab/talker speed: 1.0\n/lab/talker limits.reach: 2.0\n")
    file.write_text("/other: {ros__parameters: {speed: 1.0}}\n")
    expect_error("has no parameters for /lab/talker", *load)
    file.write_text("/lab/talker: {speed: 1.0}\n")
    expect_error("RC043 parameter-file", *load)


PUBLISH = ("topic", "pub", "/lab/in")


def test_unknown_types() -> None:
    at_once = ("--once", "-w", "0")
    send_goal = ("action", "send-goal", "/lab/navigate")
    expect_errors(
        ("did you mean 'std_msgs/msg/String'?", *PUBLISH, "String", *at_once),
        ("did you mean 'std_msgs/msg/String'?", *PUBLISH, "std_msgs/msg/Strin"),
        ("install the package that defines it", *PUBLISH, "nowhere/msg/Text"),
        ("is not a message type", *PUBLISH, "std_srvs/srv/SetBool"),
        ("is not a message type", "topic", "echo", "/lab/in", "std_srvs/srv/SetBool"),
        ("is not a service type", "service", "call", "/lab/add", "std_msgs/msg/String"),
        ("is not an action type", *send_goal, "std_srvs/srv/SetBool"),
    )


def test_invalid_names() -> None:
    words = (
        ("topic", "echo", "a topic", "std_msgs/msg/String"),
        ("topic", "hz", "a topic"),
        ("topic", "info", "a topic"),
        ("topic", "pub", "a topic", "std_msgs/msg/String"),
        ("service", "call", "a service", "std_srvs/srv/SetBool"),
        ("action", "send-goal", "an action", "composer_interfaces/action/Navigate"),
    )
    for (kind, _, name, *_), text in zip(words, errors(*words), strict=True):
        assert f"{kind} name '/{name}' contains a space" in text


def test_types_that_other_nodes_do_not_use() -> None:
    number, text, truth = (f"std_msgs/msg/{name}" for name in ("Int32", "String", "Bool"))
    switch, trigger = "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"
    echo, publish = ("topic", "echo", "/lab/count"), ("topic", "pub", "/lab/count")
    call = ("service", "call", "/lab/add")
    expect_errors(
        (f"other nodes use type {number}, not {text}\n", *echo, text, "--timeout", "5"),
        (f"other nodes use type {switch}, not {trigger}\n", *call, trigger),
    )
    # Not at the same time: its type would be one of those that other nodes use.
    expect_errors((f"other nodes use type {number}, not {truth}\n", *publish, truth, "--once"))
