from __future__ import annotations

import json

from tests.cli.compose import compose


def test_nested_messages_are_expanded() -> None:
    done = compose("interface", "show", "geometry_msgs/msg/PointStamped")
    assert done.code == 0
    assert done.out.splitlines() == [
        "std_msgs/msg/Header header",
        "  builtin_interfaces/msg/Time stamp",
        "    int32 sec",
        "    uint32 nanosec",
        "  string frame_id",
        "geometry_msgs/msg/Point point",
        "  float64 x",
        "  float64 y",
        "  float64 z",
    ]


def test_flat_does_not_expand_nested_messages() -> None:
    done = compose("interface", "show", "geometry_msgs/msg/PointStamped", "--flat")
    assert done.out == "std_msgs/msg/Header header\ngeometry_msgs/msg/Point point\n"


def test_services_actions_and_constants_are_shown() -> None:
    shown = compose("interface", "show", "std_srvs/srv/SetBool").out
    assert shown == "bool data\n---\nbool success\nstring message\n"
    action = compose("interface", "show", "composer_interfaces/action/Navigate", "--flat").out
    assert action.count("---\n") == 2
    assert "uint8 DEBUG=10" in compose("interface", "show", "rcl_interfaces/msg/Log").out


def test_types_can_be_listed_by_kind() -> None:
    services = compose("interface", "list", "--only-srvs").out.split()
    assert "std_srvs/srv/Trigger" in services
    assert all("/srv/" in name for name in services)
    everything = compose("interface", "list").out.split()
    assert {"std_msgs/msg/String", "composer_interfaces/action/Navigate"} <= set(everything)


def test_an_unknown_type_gets_a_suggestion() -> None:
    done = compose("interface", "show", "std_msgs/msg/Sting")
    assert done.code == 1
    assert "did you mean 'std_msgs/msg/String'?" in done.err


def test_json_output() -> None:
    listed = json.loads(compose("interface", "list", "--only-srvs", "--json").out)
    assert listed == compose("interface", "list", "--only-srvs").out.split()
    shown = json.loads(compose("interface", "show", "std_srvs/srv/SetBool", "--json").out)
    assert shown["name"] == "std_srvs/srv/SetBool"
    assert shown["request"]["fields"] == [{"name": "data", "type": "bool", "default": None}]
    log = json.loads(compose("interface", "show", "rcl_interfaces/msg/Log", "--json").out)
    assert {"name": "DEBUG", "type": "uint8", "value": 10} in log["message"]["constants"]
