from __future__ import annotations

import json

import pytest

from tests.cli.compose import compose


def test_nested_messages_are_expanded() -> None:
    done = compose("interface", "show", "geometry_msgs/msg/PointStamped", "--no-comments")
    assert done.code == 0
    assert done.out.splitlines() == [
        "std_msgs/Header header",
        "\tbuiltin_interfaces/Time stamp",
        "\t\tint32 sec",
        "\t\tuint32 nanosec",
        "\tstring frame_id",
        "Point point",
        "\tfloat64 x",
        "\tfloat64 y",
        "\tfloat64 z",
    ]


def test_the_types_of_a_package_are_listed() -> None:
    everything = compose("interface", "list").out.split()
    assert {"std_msgs/msg/String", "std_srvs/srv/Trigger"} <= set(everything)
    types = ["composer_interfaces/srv/PlanTrajectory", "composer_interfaces/action/Navigate"]
    assert compose("interface", "list", "composer_interfaces").out.split() == types
    assert json.loads(compose("interface", "list", "composer_interfaces", "--json").out) == types
    wrong = compose("interface", "list", "std_msg")
    assert wrong.code == 1
    assert "did you mean 'std_msgs'?" in wrong.err


def test_only_the_comments_of_nested_messages_are_left_out() -> None:
    pytest.importorskip("geometry_msgs", reason="the definitions without ROS have no comments")
    show = ("interface", "show", "geometry_msgs/msg/PointStamped")
    assert "# " in compose(*show).out
    assert "#" not in compose(*show, "--no-comments").out


def test_services_actions_and_constants_are_shown() -> None:
    shown = compose("interface", "show", "std_srvs/srv/SetBool", "--no-comments").out
    assert shown == "bool data\n---\nbool success\nstring message\n"
    action = compose("interface", "show", "composer_interfaces/action/Navigate").out
    assert action.count("---\n") == 2
    assert "uint8 DEBUG=10" in compose("interface", "show", "rcl_interfaces/msg/Log").out


def test_an_unknown_type_gets_a_suggestion() -> None:
    done = compose("interface", "show", "std_msgs/msg/Sting")
    assert done.code == 1
    assert "did you mean 'std_msgs/msg/String'?" in done.err


def test_json_output() -> None:
    shown = json.loads(compose("interface", "show", "std_srvs/srv/SetBool", "--json").out)
    assert shown["name"] == "std_srvs/srv/SetBool"
    assert shown["request"]["fields"] == [{"name": "data", "type": "bool", "default": None}]
    log = json.loads(compose("interface", "show", "rcl_interfaces/msg/Log", "--json").out)
    assert {"name": "DEBUG", "type": "uint8", "value": 10} in log["message"]["constants"]
