"""The commands for services, actions and parameters, with a plain rclpy node."""

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
    expect_error,
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


def test_a_goal_prints_feedback_and_the_result() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: 1.0}", "--feedback", "--json")
    # The first feedback may be sent before the subscription is matched.
    text = repeated_until(lambda text: text.count('"feedback"') == 3, *goal)
    printed = [json.loads(line) for line in text.splitlines()]
    assert [item["feedback"]["progress_percent"] for item in printed[:-1]] == [0.0, 1.0, 2.0]
    assert printed[-1]["status"] == "succeeded"
    assert printed[-1]["result"]["distance_traveled"] == 2.5


def test_feedback_that_arrives_with_the_result_is_printed() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: 1.0}", "--feedback", "--json")
    process = start(*goal, "--timeout", "20")
    assert process.stdout is not None
    first = json.loads(next(line for line in process.stdout if "feedback" in line))
    process.send_signal(signal.SIGSTOP)
    time.sleep(0.5)  # the talker sends the rest and ends the goal
    process.send_signal(signal.SIGCONT)
    printed = [first, *map(json.loads, process.stdout)]
    finished(process)
    assert [item["feedback"]["progress_percent"] for item in printed[:-1]] == [0.0, 1.0, 2.0]
    assert printed[-1]["status"] == "succeeded"


def test_a_rejected_goal_is_reported() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "composer_interfaces/action/Navigate", "{}")
    expect_error("'/lab/navigate' rejected the goal", *goal)


def test_a_goal_that_takes_too_long_is_canceled() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: -1}", "--json")
    done = repeated(lambda done: "canceled" in done.stdout, *goal, "--result-timeout", "0.3")
    assert done.returncode == 1, done.stderr
    assert json.loads(done.stdout)["status"] == "canceled"


def test_ctrl_c_cancels_a_goal() -> None:
    goal = ("action", "send-goal", "/lab/navigate", "{max_velocity: -1}", "--feedback", "--json")
    process = start(*goal, "--timeout", "20")
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
    expect_error("out of range", "param", "set", "talker", "speed", "-99")
    text = compose("param", "set", "talker", "gains", "[3").stderr
    assert text == "compose: '[3' is not YAML: expected ',' or ']', but got '<stream end>'\n"
    wrong = "parameter 'speed' has type double, got 'fast'"
    expect_error(wrong, "param", "set", "talker", "speed", "fast")
    large = f"[{2**63}]"
    wrong = f"parameter 'counts' has type integer_array, got {large}"
    expect_error(wrong, "param", "set", "talker", "counts", large)
    expect_error("did you mean 'speed'?", "param", "set", "talker", "sped", "1")
    expect_error("did you mean '/lab/talker'?", "param", "list", "taker")


def test_a_call_is_repeated_until_ctrl_c() -> None:
    call = ("service", "call", "/lab/add", "std_srvs/srv/SetBool", "{data: true}")
    process = start(*call, "-r", "20", "--json", "--timeout", "20")
    assert process.stdout is not None
    responses = [json.loads(process.stdout.readline()) for _ in range(3)]
    assert responses == [{"success": True, "message": "switched"}] * 3
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130


def test_a_parameter_is_described() -> None:
    assert json.loads(listed(("speed",), "param", "describe", "talker", "speed", "--json")) == {
        "name": "speed",
        "type": "double",
        "description": "How fast.",
        "minimum": 0.0,
        "maximum": 5.0,
    }


def test_parameters_of_all_nodes_are_listed_and_several_described() -> None:
    everything = json.loads(listed(("/lab/talker",), "param", "list", "--json"))
    assert {"speed", "name", "gains"} <= set(everything["/lab/talker"])
    head = "/lab/talker:\n"
    listed((head,), "param", "list")
    describe = ("param", "describe", "talker", "speed", "name", "--json")
    several = json.loads(listed(("speed",), *describe))
    assert [item["name"] for item in several] == ["speed", "name"]


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
