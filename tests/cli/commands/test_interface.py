from __future__ import annotations

import json

import pytest

from tests.cli.compose import compose


def test_nested_messages_are_expanded_without_their_comments() -> None:
    show = ("interface", "show", "geometry_msgs/msg/PointStamped")
    done = compose(*show, "--no-comments")
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
    pytest.importorskip("geometry_msgs", reason="the definitions without ROS have no comments")
    assert "# " in compose(*show).out


def test_the_types_of_a_package_are_listed() -> None:
    everything = compose("interface", "list").out.split()
    assert {"std_msgs/msg/String", "std_srvs/srv/Trigger"} <= set(everything)
    types = ["composer_interfaces/srv/PlanTrajectory", "composer_interfaces/action/Navigate"]
    assert compose("interface", "list", "composer_interfaces").out.split() == types
    assert json.loads(compose("interface", "list", "composer_interfaces", "--json").out) == types


def test_services_actions_and_constants_are_shown() -> None:
    show = ("interface", "show", "std_srvs/srv/SetBool")
    assert compose(*show, "--no-comments").out == "bool data\n---\nbool success\nstring message\n"
    shown = json.loads(compose(*show, "--json").out)
    assert shown["name"] == "std_srvs/srv/SetBool"
    assert shown["request"]["fields"] == [{"name": "data", "type": "bool", "default": None}]
    action = compose("interface", "show", "composer_interfaces/action/Navigate").out
    assert action.count("---\n") == 2
    show = ("interface", "show", "rcl_interfaces/msg/Log")
    assert "uint8 DEBUG=10" in compose(*show).out
    log = json.loads(compose(*show, "--json").out)
    assert {"name": "DEBUG", "type": "uint8", "value": 10} in log["message"]["constants"]


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (("show", "std_msgs/msg/Sting"), "did you mean 'std_msgs/msg/String'?"),
        (("list", "std_msg"), "did you mean 'std_msgs'?"),
    ],
)
def test_an_unknown_name_gets_a_suggestion(words: tuple[str, ...], hint: str) -> None:
    done = compose("interface", *words)
    assert done.code == 1
    assert hint in done.err
